#pragma once

#include "base/bounded_vector.h"
#include "base/time.h"
#include "model/points.h"

namespace mocap {

/// More blobs than in an image of a wand: such an image is not searched for a wand.
inline constexpr std::size_t kMaxCalibrationSpots = 64;

/// A blob of one marker.
struct CalibrationSpot {
  PixelPoint at;
  double sigma_px = 0.1;  ///< standard deviation of the position, each axis
};

/// An image for the calibration: the blobs that neither touch the image border nor show several markers.
struct CalibrationImage {
  Timestamp exposed_at;
  int width_px = 0;
  int height_px = 0;
  BoundedVector<CalibrationSpot, kMaxCalibrationSpots> spots;  ///< none if there are more than fit in
};

}  // namespace mocap
