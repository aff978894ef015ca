#pragma once

#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "model/skeleton.h"

namespace mocap::identify {

/// Angle of the arms below the T-pose in an A-pose (45 degrees), largest deviation of a joint (12 degrees), and
/// smallest fraction of the markers. Chosen by hand; not yet measured (evidence for the arm angle: decision 0002).
inline constexpr double kAPoseArmAngle_rad = 0.785;
inline constexpr double kMaxAPoseDeviation_rad = 0.2;
inline constexpr double kMinAPoseMarkerFraction = 0.96;

/// A pose, other than the rest pose, in which an unknown body is identified.
struct CalibrationPose {
  MarkerSet set;  ///< the same body; its rest pose is the calibration pose
  /// By bone: rotation of its frame in the calibration pose. In rest pose the frame is parallel to the world.
  std::vector<Eigen::Quaterniond> rotations;
};

/// A-pose: the rest pose with both arms straight and lowered by `by_rad` at the shoulders. Nothing if the skeleton has
/// no arm to the left or none to the right whose joint has this range.
std::optional<CalibrationPose> make_a_pose(const MarkerSet& set, double by_rad);

}  // namespace mocap::identify
