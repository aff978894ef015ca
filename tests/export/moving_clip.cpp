#include "export/moving_clip.h"

#include <cmath>
#include <limits>
#include <numbers>

#include "support/test_body.h"

namespace mocap::exports::test {
namespace {

constexpr std::size_t kFrames = 45;

bool is_lost(std::size_t subject, const std::string& bone, std::size_t frame) {
  switch (subject) {
    case 0: return bone == "LeftLowArm" && frame >= 10 && frame <= 15;
    case 1: return frame <= 4 || (frame >= 20 && frame <= 24);
    default: return frame >= 30;
  }
}

Eigen::Quaterniond about(const Eigen::Vector3d& axis, double angle_rad) {
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, axis));
}

}  // namespace

Pose sample_pose(const Clip& clip, std::size_t subject, std::size_t bone, std::size_t frame) {
  const Bone& its = clip.subjects[subject].subject.marker_set.skeleton.bones[bone];
  const double t = static_cast<double>(frame) / static_cast<double>(kFrames - 1);
  const double who = static_cast<double>(subject);
  if (its.parent < 0) {
    const Eigen::Quaterniond turn = about(Eigen::Vector3d::UnitZ(), (who + 8.0) * t);
    return {{2.0 * t - who, 1.5 * who + std::sin(5.0 * t), 0.9 + 0.2 * std::cos(7.0 * t)},
            turn * about(Eigen::Vector3d::UnitY(), 0.4 * std::sin(9.0 * t))};
  }
  if (its.name == "Chest") {  // frame 22 is at exactly 90 degrees
    const Eigen::Vector3d axis = subject == 0 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
    return {its.rest_offset_m, about(axis, std::numbers::pi * t)};
  }
  const double phase = static_cast<double>(bone);
  const Eigen::Vector3d axis = Eigen::Vector3d(std::sin(phase), std::cos(2.0 * phase), std::sin(3.0 * phase + 1.0));
  const double stretch_m = subject == 1 && its.name == "Head" ? 0.005 * std::sin(6.0 * t) : 0.0;
  return {its.rest_offset_m + stretch_m * Eigen::Vector3d::UnitZ(),
          about(axis.normalized(), 1.5 * std::sin(4.0 * t + phase))};
}

std::size_t shown_frame(std::size_t subject, const std::string& bone, std::size_t frame) {
  std::size_t shown = frame;
  while (shown > 0 && is_lost(subject, bone, shown)) {
    --shown;
  }
  while (is_lost(subject, bone, shown)) {
    ++shown;
  }
  return shown;
}

Clip moving_clip() {
  Clip clip;
  clip.name = "walk \"one\"";
  clip.producer = "mocapd 0.1.0";
  clip.rate = {30000, 1001};
  clip.frames = kFrames;
  clip.first_frame = 100;
  clip.subjects.push_back({{"Anna", mocap::test::person("baseline41"), true}, {}, {}});
  clip.subjects.push_back({{"Ben Two", mocap::test::person("baseline41"), true}, {}, {}});
  clip.subjects.push_back({{"Anna", mocap::test::person("rigid4"), true}, {}, {}});
  for (std::size_t s = 0; s < clip.subjects.size(); ++s) {
    const std::vector<Bone>& bones = clip.subjects[s].subject.marker_set.skeleton.bones;
    for (std::size_t f = 0; f < kFrames; ++f) {
      for (std::size_t b = 0; b < bones.size(); ++b) {
        BoneSample sample{sample_pose(clip, s, b, f), BoneState::Measured};
        if (is_lost(s, bones[b].name, f)) {
          sample.state = BoneState::Lost;
          sample.parent_from_bone.position.setConstant(std::numeric_limits<double>::quiet_NaN());
        }
        clip.subjects[s].bones.push_back(sample);
      }
    }
  }
  return clip;
}

}  // namespace mocap::exports::test
