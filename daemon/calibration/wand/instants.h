#pragma once

#include <vector>

#include "calibration/wand/wand_recording.h"

namespace mocap::calibration {

/// The pictures of one instant: index of the picture by camera, -1 where a camera has none.
struct Instant {
  Timestamp at;
  std::vector<int> picture;
};

/// The median time between two pictures of the camera that has most; 0 for an empty take.
Duration period_of(const Take& take);

/// Gathers pictures that were exposed within half a period (or `most_skew` where that is less) of the first of them.
std::vector<Instant> gather_instants(const Take& take, Duration most_skew);

}  // namespace mocap::calibration
