#pragma once

#include <vector>

#include "base/time.h"
#include "model/points.h"

namespace mocap::calibration {

/// A bright spot in one image.
struct Spot {
  PixelPoint at;
  double sigma_px = 0.1;  ///< standard deviation of each axis; over 0
};

/// What one camera saw at one instant.
struct Picture {
  Timestamp exposed_at;
  std::vector<Spot> spots;
};

/// What the cameras saw while somebody waved a wand: pictures by camera, in the order of the rig, each in the order of
/// their exposure.
struct Take {
  std::vector<std::vector<Picture>> cameras;
};

}  // namespace mocap::calibration
