#include "pose/bone_pose_hypothesis.h"

#include <algorithm>
#include <numbers>

#include "kinematics/rotation.h"

namespace mocap::pose {
namespace {

constexpr int kTwists = 16;

// A bone's own joint and those of its children, if it were turned so.
double beyond_about(const Skeleton& skeleton, std::span<const BoneReading> bones, std::size_t bone,
                    const Eigen::Quaterniond& turn) {
  double sum = 0.0;
  const int parent = skeleton.bones[bone].parent;
  if (parent >= 0) {
    const Eigen::Quaterniond& above = bones[static_cast<std::size_t>(parent)].world.rotation;
    sum += beyond_range2(skeleton.bones[bone], above.conjugate() * turn);
  }
  for (std::size_t c = bone + 1; c < bones.size(); ++c) {
    const BoneReading& below = bones[c];
    if (skeleton.bones[c].parent != static_cast<int>(bone) || below.laid == Laid::Unseen) continue;
    Eigen::Quaterniond local = turn.conjugate() * below.world.rotation;
    if (below.laid == Laid::Swung) local = kinematics::turn_between(below.axis, local * below.axis);
    sum += beyond_range2(skeleton.bones[c], local);
  }
  return sum;
}

}  // namespace

double beyond_range2(const Bone& bone, const Eigen::Quaterniond& local) {
  const Eigen::Vector3d phi = kinematics::rotation_vector(local);
  double sum = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    const auto range = bone.turns[static_cast<std::size_t>(axis)].value_or(AngleRange{0.0, 0.0});
    const double by = phi[axis] - std::clamp(phi[axis], range.min_rad, range.max_rad);
    sum += by * by;
  }
  return sum;
}

void untwist(const Skeleton& skeleton, std::span<BoneReading> bones) {
  for (std::size_t b = 0; b < bones.size(); ++b) {
    BoneReading& bone = bones[b];
    const int parent = skeleton.bones[b].parent;
    if (bone.laid == Laid::Unseen && parent >= 0)
      bone.world.rotation = bones[static_cast<std::size_t>(parent)].world.rotation;
    if (bone.laid != Laid::Swung) continue;
    const Eigen::Quaterniond begin = bone.world.rotation;
    double best = 1e9;
    for (int i = 0; i < kTwists; ++i) {
      const Eigen::Quaterniond turn = begin * kinematics::turn_by(2.0 * std::numbers::pi * i / kTwists * bone.axis);
      const double beyond = beyond_about(skeleton, bones, b, turn);
      if (beyond >= best - 1e-9) continue;
      best = beyond;
      bone.world.rotation = turn;
    }
  }
}

void to_locals(const Skeleton& skeleton, std::span<const BoneReading> bones, std::span<Pose> locals) {
  for (std::size_t b = 0; b < locals.size(); ++b) {
    locals[b] = bones[b].world;
    const int parent = skeleton.bones[b].parent;
    if (parent < 0) continue;
    const Eigen::Quaterniond& above = bones[static_cast<std::size_t>(parent)].world.rotation;
    locals[b].rotation = (above.conjugate() * locals[b].rotation).normalized();
  }
}

}  // namespace mocap::pose
