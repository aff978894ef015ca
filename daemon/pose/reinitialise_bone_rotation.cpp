// The part of SkeletonTracker that turns a limb whose markers are off, and small steps do not mend it.

#include <algorithm>
#include <optional>

#include "pose/skeleton_tracker.h"

namespace mocap::pose {
namespace {

// Markers of a bone that are off by this, rms, may be on a bone that is turned the wrong way round.
constexpr double kMaxBoneRms_m = 0.025;
// A marker in the joint does not turn with its bone.
constexpr double kInJoint_m = 1e-3;

}  // namespace

// Turns the bones whose own markers, two or more, are off.
bool SkeletonTracker::reinitialise_bone_rotation(std::span<const kinematics::Observation> seen) {
  std::fill(squared_error_m2_.begin(), squared_error_m2_.end(), 0.0);
  std::fill(marker_count_.begin(), marker_count_.end(), 0);
  for (const kinematics::Observation& one : seen) {
    const auto m = static_cast<std::size_t>(one.marker);
    const MarkerOnBone& marker = pose_.marker_set().markers[m];
    if (marker.offset_m.norm() < kInJoint_m || one.bearing_only || !kinematics::is_usable(one)) continue;
    squared_error_m2_[static_cast<std::size_t>(marker.bone)] += (pose_.marker_at(m) - one.position).squaredNorm();
    ++marker_count_[static_cast<std::size_t>(marker.bone)];
  }
  bool turned = false;
  for (std::size_t b = 1; b < squared_error_m2_.size(); ++b) {
    const bool off = marker_count_[b] >= 2 && squared_error_m2_[b] > kMaxBoneRms_m * kMaxBoneRms_m * marker_count_[b];
    turned = (off && reinitialise_bone_rotation(b, seen)) || turned;
  }
  return turned;
}

// By its own markers and the joints at its ends.
bool SkeletonTracker::reinitialise_bone_rotation(std::size_t bone, std::span<const kinematics::Observation> seen) {
  const auto& bones = pose_.marker_set().skeleton.bones;
  pairs_.clear();
  pairs_.push_back({Eigen::Vector3d::Zero(), pose_.world()[bone].position, 1.0});
  for (const kinematics::Observation& one : seen) {
    const MarkerOnBone& marker = pose_.marker_set().markers[static_cast<std::size_t>(one.marker)];
    if (marker.bone == static_cast<int>(bone) && !one.bearing_only && kinematics::is_usable(one))
      pairs_.push_back({marker.offset_m, one.position, 1.0});
  }
  const std::optional<geometry::RigidFit> laid = geometry::fit_rigid(pairs_);
  if (!laid) return false;
  std::copy(pose_.locals().begin(), pose_.locals().end(), trial_pose_.begin());
  const Pose& above = pose_.world()[static_cast<std::size_t>(bones[bone].parent)];
  trial_pose_[bone].rotation = (above.rotation.conjugate() * laid->to_from.rotation).normalized();
  pose_.set_locals(trial_pose_);
  return true;
}

}  // namespace mocap::pose
