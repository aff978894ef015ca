#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "model/skeleton.h"

namespace mocap::identify {

/// A pose that a body holds before it is known, other than its rest pose.
struct CalibrationPose {
  MarkerSet set;  ///< the same body, with the stance for its rest pose
  std::vector<Eigen::Quaterniond>
      rotations;  ///< by bone: how its frame lies in the stance, parallel to the world at rest
};

/// A-pose: the rest pose with both arms straight and lowered by `by_rad` at the shoulders. Nothing where the skeleton
/// has no two arms that can: limbs that reach to the left and to the right, with a joint that turns so far.
std::optional<CalibrationPose> make_a_pose(const MarkerSet& set, double by_rad);

}  // namespace mocap::identify
