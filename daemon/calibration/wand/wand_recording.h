#pragma once

#include <vector>

#include "base/time.h"
#include "model/points.h"

namespace mocap::calibration {

/// The centroid of one blob.
struct Spot {
  PixelPoint at;
  double sigma_px = 0.1;  ///< standard deviation per axis; greater than 0
};

/// The blobs of one image.
struct Picture {
  Timestamp exposed_at;
  std::vector<Spot> spots;
};

/// The blobs of all cameras while a wand was waved: images by camera, in the order of the rig, those of one camera in
/// the order of their exposure.
struct Take {
  std::vector<std::vector<Picture>> cameras;
};

}  // namespace mocap::calibration
