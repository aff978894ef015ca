#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "detect/kernels/detect_kernels.h"
#include "model/blob.h"

namespace mocap::detect {

/// What is bright in an image, in the format's own levels.
struct GreyLevels {
  std::uint32_t threshold = 1;
  std::uint32_t top = 255;  ///< the brightest value of the format
  double background = 0.0;
  double noise = 0.0;         ///< standard deviation
  std::optional<double> low;  ///< given by the operator, else from background and noise
};

/// A blob's box, and the sums over it.
struct IntensitySums {
  int middle_x = 0, middle_y = 0;      ///< of the box, in the image
  int width_px = 0, height_px = 0;     ///< of the box
  std::uint32_t peak = 0, bright = 0;  ///< the brightest of its pixels; how many reach the threshold
  std::uint32_t at_top = 0;            ///< how many are as bright as the format can say
  std::uint32_t span = 1;              ///< grey levels from u = 0 to u = 1
  double roundness = 1.0;
  BoxSums sums;
};

struct MeasuredBlob {
  Blob blob;                              ///< all but its axis
  double radius_px = 0.0, edge_px = 0.0;  ///< of a disc with that light, and how wide its edge is
};

/// Where nothing else tells, a middle may be off by about this share of the radius.
inline constexpr double kUnknownCentroidSigma = 0.3;

inline constexpr std::size_t kBlobLanes = 8;

/// Tells the blobs of up to kBlobLanes lights; `found` has room for as many. One root or quotient waits for another:
/// eight blobs take little longer than one. A blob's figures do not depend on those beside it.
void measure_blobs(const GreyLevels& grey_levels, std::span<const IntensitySums> intensity_sums,
                   std::span<MeasuredBlob> found);

/// The same for one.
MeasuredBlob measure_blob(const GreyLevels& grey_levels, const IntensitySums& intensity);

}  // namespace mocap::detect
