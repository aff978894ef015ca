#include "kinematics/kinematic_tree.h"

#include "base/expects.h"

namespace mocap::kinematics {

JointState rest_state(const Skeleton& skeleton, const Eigen::Vector3d& root_m) {
  return {root_m, std::vector<Eigen::Quaterniond>(skeleton.bones.size(), Eigen::Quaterniond::Identity())};
}

void compute_forward_kinematics(const Skeleton& skeleton, const Eigen::Vector3d& root_m,
                                std::span<const Eigen::Quaterniond> rotations, std::span<Pose> into) {
  MOCAP_EXPECTS(rotations.size() == skeleton.bones.size() && into.size() == skeleton.bones.size());
  for (std::size_t i = 0; i < skeleton.bones.size(); ++i) {
    const Bone& bone = skeleton.bones[i];
    if (bone.parent < 0) {
      into[i] = {root_m, rotations[i]};
    } else {
      into[i] = into[static_cast<std::size_t>(bone.parent)] * Pose{bone.rest_offset_m, rotations[i]};
    }
  }
}

WorldPoint marker_position(const MarkerOnBone& marker, const Pose& world_from_bone) {
  return {world_from_bone * marker.offset_m};
}

}  // namespace mocap::kinematics
