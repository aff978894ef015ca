#include "identify/calibration_pose.h"

#include <gtest/gtest.h>

#include <string>

#include "identify/tpose_finder.h"
#include "kinematics/rotation.h"
#include "support/test_body.h"

namespace mocap::identify {
namespace calibration_pose_test {

using test::person;

constexpr double kLowered_rad = 0.785;

// The local poses with both upper arms, found by their names, lowered. Independent of make_a_pose.
std::vector<Pose> lowered(const kinematics::PoseFit& body, double left_rad, double right_rad) {
  std::vector<Pose> locals(body.locals().begin(), body.locals().end());
  const auto& bones = body.marker_set().skeleton.bones;
  for (std::size_t b = 0; b < bones.size(); ++b) {
    if (bones[b].name == "LeftUpArm") locals[b].rotation = kinematics::from_rotation_vector({-left_rad, 0.0, 0.0});
    if (bones[b].name == "RightUpArm") locals[b].rotation = kinematics::from_rotation_vector({right_rad, 0.0, 0.0});
  }
  return locals;
}

class ShippedSets : public ::testing::TestWithParam<const char*> {};

TEST_P(ShippedSets, HaveAnAPoseWithLoweredUpperArms) {
  const MarkerSet set = person(GetParam());
  kinematics::PoseFit body(set, kinematics::PoseFit::Lengths::Fixed);
  body.set_locals(lowered(body, kLowered_rad, kLowered_rad));

  const auto a_pose = make_a_pose(set, kLowered_rad);

  ASSERT_TRUE(a_pose);
  const kinematics::PoseFit at_rest(a_pose->set, kinematics::PoseFit::Lengths::Fixed);
  for (std::size_t m = 0; m < set.markers.size(); ++m) {
    EXPECT_LT((at_rest.marker_at(m) - body.marker_at(m)).norm(), 1e-12) << set.markers[m].name;
  }
  for (std::size_t b = 0; b < set.skeleton.bones.size(); ++b) {
    EXPECT_LT(test::angle_between(a_pose->rotations[b], body.world()[b].rotation), 1e-12) << set.skeleton.bones[b].name;
  }
}

TEST_P(ShippedSets, AreIdentifiedInAPoseWithTheReposedMarkerSet) {
  const MarkerSet set = person(GetParam());
  const auto a_pose = make_a_pose(set, kLowered_rad);
  ASSERT_TRUE(a_pose);
  TPoseFinder finder(a_pose->set, {.max_joint_angle_rad = 0.2}, 128);
  kinematics::PoseFit body(set, kinematics::PoseFit::Lengths::Fixed);
  for (const double off_rad : {-0.18, -0.1, 0.0, 0.1, 0.18}) {
    std::vector<Pose> locals = lowered(body, kLowered_rad + off_rad, kLowered_rad - 0.03);
    locals[0] = {{0.4, -0.3, 0.95}, kinematics::from_rotation_vector({0.0, 0.0, 5.0 * off_rad + 1.0})};
    body.set_locals(locals);
    std::vector<Eigen::Vector3d> points;
    for (std::size_t m = 0; m < set.markers.size(); ++m) points.push_back(body.marker_at(m));

    const auto& found = finder.find(points);

    ASSERT_TRUE(found) << off_rad;
    EXPECT_EQ(found->matched, static_cast<int>(set.markers.size())) << off_rad;
    for (std::size_t m = 0; m < set.markers.size(); ++m) {
      EXPECT_EQ(found->point_of_marker[m], static_cast<int>(m)) << off_rad << " " << set.markers[m].name;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(CalibrationPose, ShippedSets, ::testing::Values("openmocap18", "baseline41"),
                         [](const auto& set) { return std::string(set.param); });

TEST(CalibrationPose, IsNotIdentifiedIfTheArmsHangFurtherDown) {
  const MarkerSet set = person("baseline41");
  const auto a_pose = make_a_pose(set, kLowered_rad);
  ASSERT_TRUE(a_pose);
  TPoseFinder finder(a_pose->set, {.max_joint_angle_rad = 0.2}, 128);
  kinematics::PoseFit body(set, kinematics::PoseFit::Lengths::Fixed);
  for (const double lowered_rad : {1.15, 1.3, 1.5}) {
    std::vector<Pose> locals = lowered(body, lowered_rad, lowered_rad);
    locals[0].position = {0.0, 0.0, 0.95};
    body.set_locals(locals);
    std::vector<Eigen::Vector3d> points;
    for (std::size_t m = 0; m < set.markers.size(); ++m) points.push_back(body.marker_at(m));

    EXPECT_FALSE(finder.find(points)) << lowered_rad;
  }
}

TEST(CalibrationPose, DoesNotExistForABodyWithoutArmsOfThatRange) {
  MarkerSet stiff = person("openmocap18");
  for (Bone& bone : stiff.skeleton.bones) bone.rotation_limits[0] = AngleRange{-0.5, 0.5};
  MarkerSet one_bone = person("openmocap18");
  one_bone.skeleton.bones.resize(1);
  one_bone.markers.clear();

  EXPECT_FALSE(make_a_pose(stiff, kLowered_rad));
  EXPECT_FALSE(make_a_pose(one_bone, kLowered_rad));
  EXPECT_FALSE(make_a_pose({}, kLowered_rad));
}

}  // namespace calibration_pose_test
}  // namespace mocap::identify
