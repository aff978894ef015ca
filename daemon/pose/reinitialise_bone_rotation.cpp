// SkeletonTracker, continued: new rotations of bones whose markers have large residuals that small steps do not reduce.

#include <algorithm>
#include <optional>

#include "kinematics/kinematic_tree.h"
#include "pose/skeleton_tracker.h"

namespace mocap::pose {
namespace {

// A bone whose own markers have a larger rms residual may have a wrong rotation. Chosen by hand; not yet measured.
constexpr double kMaxBoneRms_m = 0.025;

}  // namespace

// Reinitialises all bones with two or more own markers of large residual.
bool SkeletonTracker::reinitialise_bone_rotation(std::span<const kinematics::Observation> seen) {
  std::fill(squared_error_m2_.begin(), squared_error_m2_.end(), 0.0);
  std::fill(marker_count_.begin(), marker_count_.end(), 0);
  for (const kinematics::Observation& one : seen) {
    const auto m = static_cast<std::size_t>(one.marker);
    const MarkerOnBone& marker = pose_.marker_set().markers[m];
    if (kinematics::sits_in_joint(marker) || one.bearing_only || !kinematics::is_usable(one)) continue;
    squared_error_m2_[static_cast<std::size_t>(marker.bone)] += (pose_.marker_at(m) - one.position).squaredNorm();
    ++marker_count_[static_cast<std::size_t>(marker.bone)];
  }
  bool changed = false;
  for (std::size_t b = 1; b < squared_error_m2_.size(); ++b) {
    const bool has_large_residual =
        marker_count_[b] >= 2 && squared_error_m2_[b] > kMaxBoneRms_m * kMaxBoneRms_m * marker_count_[b];
    changed = (has_large_residual && reinitialise_bone_rotation(b, seen)) || changed;
  }
  return changed;
}

// Computes the rotation from the bone's own markers and its joint by a rigid fit.
bool SkeletonTracker::reinitialise_bone_rotation(std::size_t bone, std::span<const kinematics::Observation> seen) {
  const auto& bones = pose_.marker_set().skeleton.bones;
  pairs_.clear();
  pairs_.push_back({Eigen::Vector3d::Zero(), pose_.world()[bone].position, 1.0});
  for (const kinematics::Observation& one : seen) {
    const MarkerOnBone& marker = pose_.marker_set().markers[static_cast<std::size_t>(one.marker)];
    if (marker.bone == static_cast<int>(bone) && !one.bearing_only && kinematics::is_usable(one))
      pairs_.push_back({marker.offset_m, one.position, 1.0});
  }
  const std::optional<geometry::RigidFit> aligned = geometry::fit_rigid(pairs_);
  if (!aligned) return false;
  std::copy(pose_.locals().begin(), pose_.locals().end(), trial_pose_.begin());
  const Pose& parent = pose_.world()[static_cast<std::size_t>(bones[bone].parent)];
  trial_pose_[bone].rotation = (parent.rotation.conjugate() * aligned->to_from.rotation).normalized();
  pose_.set_locals(trial_pose_);
  return true;
}

}  // namespace mocap::pose
