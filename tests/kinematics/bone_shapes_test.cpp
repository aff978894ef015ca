#include "kinematics/bone_shapes.h"

#include <gtest/gtest.h>

#include "kinematics/pose_fit.h"
#include "support/test_body.h"

namespace mocap::kinematics {
namespace bone_shapes_test {

TEST(BoneShapes, PointsAndJointsAgreeWithTheWorldPositionsOfAPose) {
  const MarkerSet set = test::person("openmocap18");
  std::mt19937 random(1);
  PoseFit pose(set, PoseFit::Lengths::Fixed);
  pose.set_locals(test::random_pose(set, 0.5, random));

  const BoneShapes shapes(set);

  for (std::size_t b = 0; b < shapes.size(); ++b) {
    for (const ShapePoint& point : shapes.of(b).points) {
      const Eigen::Vector3d marker = pose.marker_at(static_cast<std::size_t>(point.marker));
      EXPECT_LT((pose.world()[b] * point.position_m - marker).norm(), 1e-3);  // kInJoint_m
    }
    for (const ShapeJoint& joint : shapes.of(b).joints) {
      const Pose& neighbour = pose.world()[static_cast<std::size_t>(joint.bone)];
      EXPECT_LT((pose.world()[b] * joint.joint_in_bone_m - neighbour * joint.joint_in_neighbour_m).norm(), 1e-9);
    }
  }
}

TEST(BoneShapes, KeepAtMostTheMaximumNumberOfPoints) {
  MarkerSet set = test::person("rigid5");
  while (set.markers.size() < kMaxShapePoints + 4) {
    MarkerOnBone copy = set.markers[0];
    copy.offset_m.x() += 0.001 * static_cast<double>(set.markers.size());
    set.markers.push_back(copy);
  }

  EXPECT_EQ(BoneShapes(set).of(0).points.size(), kMaxShapePoints);
}

TEST(BoneShapes, DetermineARotationByThreePointsOffALineOnly) {
  MarkerSet set = test::person("rigid3");
  const bool triangle = BoneShapes(set).determines_rotation(0);
  for (std::size_t m = 0; m < 3; ++m) set.markers[m].offset_m = {0.1 * static_cast<double>(m), 0.0, 0.0};

  EXPECT_TRUE(triangle);
  EXPECT_FALSE(BoneShapes(set).determines_rotation(0));
}

TEST(BoneShapes, TakeOverFittedOffsets) {
  const MarkerSet set = test::person("baseline41");
  MarkerSet fitted = set;
  for (Bone& bone : fitted.skeleton.bones) bone.rest_offset_m *= 1.1;
  for (MarkerOnBone& marker : fitted.markers) marker.offset_m *= 1.2;
  BoneShapes shapes(set);

  shapes.refit(fitted);

  const BoneShapes expected(fitted);
  for (std::size_t b = 0; b < shapes.size(); ++b) {
    for (const ShapePoint& point : shapes.of(b).points) {
      const MarkerOnBone& marker = fitted.markers[static_cast<std::size_t>(point.marker)];
      if (marker.bone == static_cast<int>(b)) {
        EXPECT_EQ(point.position_m, marker.offset_m);
      }
    }
    ASSERT_EQ(shapes.of(b).joints.size(), expected.of(b).joints.size());
    for (std::size_t j = 0; j < expected.of(b).joints.size(); ++j) {
      EXPECT_EQ(shapes.of(b).joints[j].joint_in_bone_m, expected.of(b).joints[j].joint_in_bone_m);
      EXPECT_EQ(shapes.of(b).joints[j].joint_in_neighbour_m, expected.of(b).joints[j].joint_in_neighbour_m);
    }
  }
}

}  // namespace bone_shapes_test
}  // namespace mocap::kinematics
