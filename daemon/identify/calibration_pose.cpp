#include "identify/calibration_pose.h"

#include <cmath>
#include <cstddef>

namespace mocap::identify {
namespace {

// Smallest length of the upper arm as a fraction of the arm's reach; collar bones are shorter.
constexpr double kMinReachFraction = 0.2;
// Smallest sideways extent of the upper arm as a fraction of its length.
constexpr double kMinSidewaysFraction = 0.8;

struct Joints {
  std::vector<Eigen::Vector3d> at_m;  // position in rest pose, by bone

  explicit Joints(const Skeleton& skeleton) {
    for (const Bone& bone : skeleton.bones) {
      const bool root = bone.parent < 0;
      at_m.push_back(root ? Eigen::Vector3d::Zero()
                          : Eigen::Vector3d(at_m[static_cast<std::size_t>(bone.parent)] + bone.rest_offset_m));
    }
  }
};

bool has_range(const Bone& bone, double angle_x_rad) {
  const auto& range = bone.rotation_limits[0];
  return range && range->min_rad <= angle_x_rad && range->max_rad >= angle_x_rad;
}

// Index of the upper arm of a side (1: left, -1: right): on the chain from the trunk to the farthest joint, the bone
// nearest to the trunk that is long, points sideways and has the range. -1: none.
int upper_arm(const Skeleton& skeleton, const Joints& joints, double side, double by_rad) {
  std::size_t tip = 0;
  for (std::size_t b = 0; b < joints.at_m.size(); ++b) {
    if (side * joints.at_m[b].y() > side * joints.at_m[tip].y()) tip = b;
  }
  const double reach_m = side * joints.at_m[tip].y();
  int found = -1;
  for (std::size_t child = tip; skeleton.bones[child].parent > 0;) {
    const auto bone = static_cast<std::size_t>(skeleton.bones[child].parent);
    const Eigen::Vector3d& along_m = skeleton.bones[child].rest_offset_m;
    if (along_m.norm() > kMinReachFraction * reach_m && side * along_m.y() > kMinSidewaysFraction * along_m.norm() &&
        has_range(skeleton.bones[bone], -side * by_rad)) {
      found = static_cast<int>(bone);
    }
    child = bone;
  }
  return found;
}

}  // namespace

std::optional<CalibrationPose> make_a_pose(const MarkerSet& set, double by_rad) {
  const Joints joints(set.skeleton);
  if (joints.at_m.empty()) return std::nullopt;
  const int left = upper_arm(set.skeleton, joints, 1.0, by_rad), right = upper_arm(set.skeleton, joints, -1.0, by_rad);
  if (left < 0 || right < 0) return std::nullopt;
  CalibrationPose pose{set, {}};
  const auto about_x = [](double rad) { return Eigen::Quaterniond(Eigen::AngleAxisd(rad, Eigen::Vector3d::UnitX())); };
  for (std::size_t b = 0; b < set.skeleton.bones.size(); ++b) {
    Bone& bone = pose.set.skeleton.bones[b];
    const Eigen::Quaterniond above =
        bone.parent < 0 ? Eigen::Quaterniond::Identity() : pose.rotations[static_cast<std::size_t>(bone.parent)];
    bone.rest_offset_m = above * bone.rest_offset_m;
    const auto here = static_cast<int>(b);
    const bool lowered = here == left || here == right;
    pose.rotations.push_back(lowered ? about_x(here == left ? -by_rad : by_rad) : above);
    // The ranges are about the axes of the bone, which differ from the axes of the moved frame: they no longer apply.
    const bool moved = pose.rotations.back().w() < 1.0;
    if (moved) bone.rotation_limits.fill(AngleRange{});
  }
  for (MarkerOnBone& marker : pose.set.markers)
    marker.offset_m = pose.rotations[static_cast<std::size_t>(marker.bone)] * marker.offset_m;
  return pose;
}

}  // namespace mocap::identify
