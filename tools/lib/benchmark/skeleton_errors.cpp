#include "lib/benchmark/skeleton_errors.h"

#include <algorithm>
#include <numbers>

namespace mocap::benchmark {

SkeletonErrors::SkeletonErrors(const Skeleton& skeleton) : counts_(skeleton.bones.size()) {
  for (const Bone& bone : skeleton.bones) bones_.push_back({bone.name});
}

void SkeletonErrors::add(const SubjectPose& pose, const Pose* truth) {
  ++posed_;
  for (std::size_t b = 0; b < pose.bones.size(); ++b) {
    const BonePose& bone = pose.bones[b];
    if (bone.state == BoneState::Lost) continue;
    const double joint_cm = 100.0 * (bone.world_from_bone.position - truth[b].position).norm();
    joints_cm_.push_back(joint_cm);
    bones_[b].joint_cm += joint_cm;
    bones_[b].rotation_deg +=
        bone.world_from_bone.rotation.angularDistance(truth[b].rotation) * 180.0 / std::numbers::pi;
    ++counts_[b];
  }
}

SkeletonFigures SkeletonErrors::figures(std::uint64_t frames) {
  SkeletonFigures figures;
  figures.frames = frames;
  if (joints_cm_.empty()) return figures;
  const auto joints = static_cast<double>(joints_cm_.size());
  figures.posed_share = static_cast<double>(posed_) / static_cast<double>(frames);
  figures.joint_cm = figures.rotation_deg = 0.0;
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    figures.joint_cm += bones_[b].joint_cm / joints;
    figures.rotation_deg += bones_[b].rotation_deg / joints;
    bones_[b].joint_cm /= std::max(1.0, counts_[b]);
    bones_[b].rotation_deg /= std::max(1.0, counts_[b]);
  }
  figures.bones = bones_;
  const auto high = joints_cm_.begin() + static_cast<std::ptrdiff_t>(joints_cm_.size() * 99 / 100);
  std::ranges::nth_element(joints_cm_, high);
  figures.joint_p99_cm = *high;
  return figures;
}

}  // namespace mocap::benchmark
