#include "pose/bone_pose_hypothesis.h"

#include <algorithm>
#include <numbers>

#include "kinematics/rotation.h"

namespace mocap::pose {
namespace {

constexpr int kTwistSamples = 16;

// Range excess of a bone's own joint and of its children's joints, if the bone had this rotation.
double range_excess_about(const Skeleton& skeleton, std::span<const BonePoseHypothesis> bones, std::size_t bone,
                          const Eigen::Quaterniond& rotation) {
  double sum = 0.0;
  const int parent = skeleton.bones[bone].parent;
  if (parent >= 0) {
    const Eigen::Quaterniond& parent_rotation = bones[static_cast<std::size_t>(parent)].world.rotation;
    sum += squared_range_excess(skeleton.bones[bone], parent_rotation.conjugate() * rotation);
  }
  for (std::size_t c = bone + 1; c < bones.size(); ++c) {
    const BonePoseHypothesis& child = bones[c];
    if (skeleton.bones[c].parent != static_cast<int>(bone) || child.dof == Dof::None) continue;
    Eigen::Quaterniond local = rotation.conjugate() * child.world.rotation;
    if (child.dof == Dof::Swing) local = kinematics::rotation_between(child.axis, local * child.axis);
    sum += squared_range_excess(skeleton.bones[c], local);
  }
  return sum;
}

}  // namespace

double squared_range_excess(const Bone& bone, const Eigen::Quaterniond& local) {
  const Eigen::Vector3d phi = kinematics::rotation_vector(local);
  double sum = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto range = bone.rotation_limits[static_cast<std::size_t>(axis)].value_or(AngleRange{0.0, 0.0});
    const double by = phi[axis] - std::clamp(phi[axis], range.min_rad, range.max_rad);
    sum += by * by;
  }
  return sum;
}

void resolve_twist(const Skeleton& skeleton, std::span<BonePoseHypothesis> bones) {
  for (std::size_t b = 0; b < bones.size(); ++b) {
    BonePoseHypothesis& bone = bones[b];
    const int parent = skeleton.bones[b].parent;
    if (bone.dof == Dof::None && parent >= 0)
      bone.world.rotation = bones[static_cast<std::size_t>(parent)].world.rotation;
    if (bone.dof != Dof::Swing) continue;
    const Eigen::Quaterniond begin = bone.world.rotation;
    double best = 1e9;
    for (int i = 0; i < kTwistSamples; ++i) {
      const Eigen::Quaterniond rotation =
          begin * kinematics::from_rotation_vector(2.0 * std::numbers::pi * i / kTwistSamples * bone.axis);
      const double excess = range_excess_about(skeleton, bones, b, rotation);
      if (excess >= best - 1e-9) continue;
      best = excess;
      bone.world.rotation = rotation;
    }
  }
}

void to_local_poses(const Skeleton& skeleton, std::span<const BonePoseHypothesis> bones, std::span<Pose> locals) {
  for (std::size_t b = 0; b < locals.size(); ++b) {
    locals[b] = bones[b].world;
    const int parent = skeleton.bones[b].parent;
    if (parent < 0) continue;
    const Eigen::Quaterniond& parent_rotation = bones[static_cast<std::size_t>(parent)].world.rotation;
    locals[b].rotation = (parent_rotation.conjugate() * locals[b].rotation).normalized();
  }
}

}  // namespace mocap::pose
