#include "export/joint_motion.h"

#include "base/expects.h"

namespace mocap::exports {
namespace {

// Smallest motion of a joint that a file describes. The tolerance of the formats is 0.1 mm.
constexpr double kStill_m = 1e-6;

bool is_known(const BoneSample& sample) {
  const Pose& pose = sample.parent_from_bone;
  return sample.state != BoneState::Lost && pose.position.allFinite() && pose.rotation.coeffs().allFinite() &&
         pose.rotation.norm() > 0.5;
}

// The pose before the first known one.
Pose first_pose(const ClipSubject& subject, std::size_t frames, std::size_t bones, std::size_t bone,
                const SkinnedBone& bind) {
  for (std::size_t f = 0; f < frames; ++f) {
    const BoneSample& sample = subject.bones[f * bones + bone];
    if (is_known(sample)) {
      return {to_y_up(sample.parent_from_bone.position), to_y_up(sample.parent_from_bone.rotation).normalized()};
    }
  }
  return {bind.offset_m, Eigen::Quaterniond::Identity()};
}

Eigen::Quaterniond nearest_sign(const Eigen::Quaterniond& rotation, const Eigen::Quaterniond& before) {
  return rotation.dot(before) < 0.0 ? Eigen::Quaterniond(-rotation.coeffs()) : rotation;
}

}  // namespace

JointMotion::JointMotion(const Clip& clip, std::size_t subject, const SkinnedSkeleton& skeleton)
    : frames_(clip.frames), bones_(skeleton.bones.size()), poses_(frames_ * bones_), translates_(bones_, false) {
  const ClipSubject& from = clip.subjects[subject];
  MOCAP_EXPECTS(from.bones.size() == frames_ * bones_);
  for (std::size_t b = 0; b < bones_; ++b) {
    const SkinnedBone& bind = skeleton.bones[b];
    Pose pose = first_pose(from, frames_, bones_, b, bind);
    for (std::size_t f = 0; f < frames_; ++f) {
      const BoneSample& sample = from.bones[f * bones_ + b];
      if (is_known(sample)) {
        pose.position = to_y_up(sample.parent_from_bone.position);
        pose.rotation = nearest_sign(to_y_up(sample.parent_from_bone.rotation).normalized(), pose.rotation);
      }
      poses_[f * bones_ + b] = pose;
      translates_[b] = translates_[b] || (pose.position - bind.offset_m).norm() > kStill_m;
    }
  }
}

}  // namespace mocap::exports
