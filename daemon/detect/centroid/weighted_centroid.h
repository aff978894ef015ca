#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "detect/kernels/detect_kernels.h"
#include "model/blob.h"

namespace mocap::detect {

/// Grey levels of an image, in the format's own levels.
struct GreyLevels {
  std::uint32_t threshold = 1;
  std::uint32_t top = 255;  ///< the largest value of the format
  double background = 0.0;
  double noise = 0.0;         ///< standard deviation
  std::optional<double> low;  ///< low threshold of the operator; empty: from background and noise
};

/// The box of a blob, and the sums over it.
struct IntensitySums {
  int middle_x = 0, middle_y = 0;      ///< centre of the box, in the image
  int begin_x = 0, begin_y = 0;        ///< first pixel of the box
  int end_x = 0, end_y = 0;            ///< behind the last pixel of the box, without its padding
  std::uint32_t peak = 0, bright = 0;  ///< largest grey level; number of pixels over the threshold
  std::uint32_t at_top = 0;            ///< number of saturated pixels
  std::uint32_t span = 1;              ///< grey levels from u = 0 to u = 1
  double roundness = 1.0;
  BoxSums sums;
};

struct MeasuredBlob {
  Blob blob;                              ///< without the direction of its axis
  double radius_px = 0.0, edge_px = 0.0;  ///< radius and edge width of a disc with these sums
};

/// Standard deviation of the centre, as a share of the radius, if nothing else bounds it.
inline constexpr double kUnknownCentroidSigma = 0.3;

inline constexpr std::size_t kBlobLanes = 8;

/// Computes the blobs of at most kBlobLanes sums into `found`. Eight blobs take little longer than one, because the
/// latency of square roots and divisions is hidden. A blob's result does not depend on the other lanes.
void measure_blobs(const GreyLevels& grey_levels, std::span<const IntensitySums> intensity_sums,
                   std::span<MeasuredBlob> found);

/// The same for one blob.
MeasuredBlob measure_blob(const GreyLevels& grey_levels, const IntensitySums& intensity);

}  // namespace mocap::detect
