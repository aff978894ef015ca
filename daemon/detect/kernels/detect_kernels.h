#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "detect/kernels/bright_words.h"

namespace mocap::detect {

/// A run of bright pixels in one row: begin <= x < end.
struct Run {
  std::uint16_t y = 0;
  std::uint16_t begin = 0;
  std::uint16_t end = 0;
};

/// Input of a scan for bright pixels.
struct ScanRows {
  const std::byte* bytes = nullptr;  ///< of the first row
  std::size_t stride_bytes = 0;
  int width_px = 0;
  int rows = 0;
  int first_y = 0;              ///< the first row's
  std::uint32_t threshold = 1;  ///< 1 or more, at most what `kept` has
  std::uint16_t kept = 0xFFFF;  ///< the significant bits of a two-byte pixel
};

/// Pixels of the box around a blob, two bytes each, row after row; pixels of other blobs are 0. The width is a multiple
/// of kBoxStep_px, padded with 0.
struct Box {
  const std::uint16_t* pixels = nullptr;
  int width_px = 0;
  int height_px = 0;
};
inline constexpr int kBoxStep_px = 16;
inline constexpr int kMaxBox_px = 192;  // bound for which the sums of powers fit 32 bits

/// A window of an image with one byte a pixel.
struct ByteWindow {
  const std::byte* bytes = nullptr;  ///< of the first pixel
  std::size_t stride_bytes = 0;
  int width_px = 0;
};

struct BoxStatistics {
  std::uint32_t peak = 0;
  std::uint32_t bright = 0;  ///< number of pixels of at least the threshold
};

/// Maps a grey level to u: 0 up to `low`, 1 from `low` + `span` on, linear in between.
struct IntensityRamp {
  std::uint32_t low = 0;
  std::uint32_t span = 1;  ///< 1 to 65535
};
inline constexpr int kPowers = 3;  ///< u, u^2 and u^3: any cubic weight is a linear combination of these

/// Sums over a box, with x and y from the box's centre (width / 2, height / 2). All sums are integers, so that the
/// order of summation does not matter.
struct BoxSums {
  std::int64_t weight[kPowers] = {}, x[kPowers] = {}, y[kPowers] = {};  ///< of the powers, each 0 to kFullWeight
  std::int64_t slope2 = 0;                                              ///< of (u (1 - u))^2, each 0 to kFullSlope^2
};
inline constexpr int kFullWeight = 2048;  ///< a power of u at u = 1, to 2 units
inline constexpr int kFullSlope = 32;     ///< u (1 - u) at u = 1/2

/// The inner loops over pixels. All instruction sets give bit-identical results.
struct DetectKernels {
  std::string_view name;  ///< scalar, sse4, avx2 or avx512
  /// Appends the bright words of the rows. Rows are in order; one call for the whole image is fastest.
  void (*scan_bytes)(const ScanRows& rows, BrightWords& found);  ///< one byte a pixel
  void (*scan_words)(const ScanRows& rows, BrightWords& found);  ///< two bytes a pixel, little endian
  /// Copies the box's pixels and computes their statistics. Reads the padded width in every row, including the last.
  BoxStatistics (*widen)(const ByteWindow& window, const Box& box, std::uint16_t* pixels, std::uint32_t threshold);
  BoxStatistics (*survey)(const Box& box, std::uint32_t threshold);
  BoxSums (*weigh)(const Box& box, const IntensityRamp& weighing);
};

/// The fastest kernels of this processor.
const DetectKernels& best_kernels();
/// All kernels of this processor, the scalar ones first.
std::vector<const DetectKernels*> all_kernels();

}  // namespace mocap::detect
