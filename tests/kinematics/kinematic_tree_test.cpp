#include "kinematics/kinematic_tree.h"

#include <gtest/gtest.h>

#include <numbers>

namespace mocap::kinematics {
namespace kinematic_tree_test {

// A root, an upper bone along x and a lower bone along x, 0.3 m and 0.2 m long.
Skeleton two_links() {
  Skeleton skeleton;
  skeleton.bones.resize(3);
  skeleton.bones[1].parent = 0;
  skeleton.bones[1].rest_offset_m = {0.3, 0.0, 0.0};
  skeleton.bones[2].parent = 1;
  skeleton.bones[2].rest_offset_m = {0.2, 0.0, 0.0};
  return skeleton;
}

TEST(ForwardKinematics, AgreesWithAWorkedExample) {
  const Skeleton skeleton = two_links();
  JointState state = rest_state(skeleton, {1.0, 2.0, 3.0});
  const Eigen::Quaterniond quarter(Eigen::AngleAxisd(std::numbers::pi / 2.0, Eigen::Vector3d::UnitZ()));
  state.rotations[0] = state.rotations[1] = quarter;
  std::vector<Pose> world(3);

  compute_forward_kinematics(skeleton, state.root_m, state.rotations, world);

  EXPECT_LT((world[1].position - Eigen::Vector3d(1.0, 2.3, 3.0)).norm(), 1e-12);  // the rotation maps x to y
  EXPECT_LT((world[2].position - Eigen::Vector3d(0.8, 2.3, 3.0)).norm(), 1e-12);  // and maps y to -x
  MarkerOnBone marker;
  marker.offset_m = {0.1, 0.0, 0.0};
  EXPECT_LT((marker_position(marker, world[2]).v - Eigen::Vector3d(0.7, 2.3, 3.0)).norm(), 1e-12);
}

TEST(ForwardKinematics, OfTheRestStateAddsTheRestOffsets) {
  const Skeleton skeleton = two_links();
  const JointState state = rest_state(skeleton, Eigen::Vector3d::Zero());
  std::vector<Pose> world(3);

  compute_forward_kinematics(skeleton, state.root_m, state.rotations, world);

  EXPECT_EQ(world[2].position, Eigen::Vector3d(0.5, 0.0, 0.0));
}

TEST(SitsInJoint, HoldsWithinAMillimetre) {
  MarkerOnBone marker;

  marker.offset_m = {0.0, 0.0, 0.0009};
  EXPECT_TRUE(sits_in_joint(marker));
  marker.offset_m = {0.0, 0.0, 0.0011};
  EXPECT_FALSE(sits_in_joint(marker));
}

}  // namespace kinematic_tree_test
}  // namespace mocap::kinematics
