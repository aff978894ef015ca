#include "lib/functional/functional_joint.h"

#include <gtest/gtest.h>

#include <numbers>

#include "test_motion.h"

namespace mocap::functional {
namespace functional_joint_test {

constexpr std::size_t kFrames = 300;
const Eigen::Vector3d kJoint_m(0.0, 0.0, 1.0);  // in the world, which is the frame of the first segment

// Markers 0 to 3 rest above the joint, markers 4 to 6 hang below it and turn about it.
Eigen::Vector3d place_at(std::size_t marker, const Eigen::Quaterniond& rotation) {
  static const std::vector<Eigen::Vector3d> kPlaces_m{{0.1, 0.1, 0.2},   {-0.1, 0.1, 0.25}, {0.0, -0.15, 0.15},
                                                      {0.0, 0.0, 0.3},   {0.05, 0.0, -0.2}, {-0.05, 0.0, -0.3},
                                                      {0.0, 0.06, -0.25}};
  return kJoint_m + (marker < 4 ? kPlaces_m[marker] : Eigen::Vector3d(rotation * kPlaces_m[marker]));
}

bodyfit::LabelledTake ball_joint(double noise_m) {
  return test_motion::take_of(kFrames, 7, noise_m, [](std::size_t f, std::size_t m) {
    const double rad = 0.05 * static_cast<double>(f);
    return place_at(m, kinematics::from_rotation_vector(
                           {0.6 * std::sin(rad), 0.5 * std::sin(1.7 * rad), 0.3 * std::sin(2.3 * rad)}));
  });
}

bodyfit::LabelledTake hinge(double noise_m) {
  return test_motion::take_of(kFrames, 7, noise_m, [](std::size_t f, std::size_t m) {
    return place_at(m,
                    kinematics::from_rotation_vector({0.0, 0.7 + 0.7 * std::sin(0.05 * static_cast<double>(f)), 0.0}));
  });
}

Eigen::Vector3d in_world(const SegmentMotion& segment, const Eigen::Vector3d& place_m) {
  return *segment.world_from_segment[0] * place_m;
}

TEST(FunctionalJoint, IsTheCentreOfABallJoint) {
  const auto take = ball_joint(0.002);
  const SegmentMotion upper = track_segment(take, {0, 1, 2, 3}, 0), lower = track_segment(take, {4, 5, 6}, 0);

  const auto joint = find_joint(take, upper, lower);

  ASSERT_TRUE(joint);
  EXPECT_LT((in_world(upper, joint->in_one_m) - kJoint_m).norm(), 0.005);
  EXPECT_LT((in_world(lower, joint->in_other_m) - kJoint_m).norm(), 0.005);
  EXPECT_LT(joint->rms_m, 0.015);
}

TEST(FunctionalJoint, IsOnTheAxisOfAHingeNearTheMarkers) {
  const auto take = hinge(0.001);
  const SegmentMotion upper = track_segment(take, {0, 1, 2, 3}, 0), lower = track_segment(take, {4, 5, 6}, 0);

  const auto joint = find_joint(take, upper, lower);
  const JointRotation turned = measure_rotation(upper, lower);

  ASSERT_TRUE(joint);
  Eigen::Vector3d off_m = in_world(upper, joint->in_one_m) - kJoint_m;
  EXPECT_LT(std::abs(off_m.y()), 0.15);  // anywhere along the axis, but near the markers
  off_m.y() = 0.0;
  EXPECT_LT(off_m.norm(), 0.005);
  ASSERT_TRUE(turned.hinge_axis);
  EXPECT_GT(std::abs(turned.hinge_axis->y()), 0.999);
  EXPECT_NEAR(turned.hinge_range_rad, 1.4, 0.05);
}

TEST(FunctionalJoint, OfABallJointIsNoHinge) {
  const auto take = ball_joint(0.001);

  const JointRotation turned =
      measure_rotation(track_segment(take, {0, 1, 2, 3}, 0), track_segment(take, {4, 5, 6}, 0));

  EXPECT_FALSE(turned.hinge_axis);
  EXPECT_NEAR(turned.most_rad.x() - turned.least_rad.x(), 1.2, 0.1);
}

TEST(FunctionalJoint, OfPointsIsTheCentreOfTheirSpheres) {
  const auto take = ball_joint(0.001);
  const SegmentMotion upper = track_segment(take, {0, 1, 2, 3}, 0);

  const auto two = find_joint_of_points(take, upper, track_segment(take, {4, 5}, 0));
  const auto one = find_joint_of_points(take, upper, track_segment(take, {6}, 0));

  ASSERT_TRUE(two && one);
  EXPECT_LT((in_world(upper, two->in_one_m) - kJoint_m).norm(), 0.01);
  EXPECT_LT((in_world(upper, one->in_one_m) - kJoint_m).norm(), 0.02);
  EXPECT_LT(two->rms_m, 0.003);
}

// A joint that does not turn is anywhere: it is placed between the nearest markers.
TEST(FunctionalJoint, ThatDoesNotTurnIsBetweenTheNearestMarkers) {
  const auto take = test_motion::take_of(
      kFrames, 7, 0.0005, [](std::size_t, std::size_t m) { return place_at(m, Eigen::Quaterniond::Identity()); });
  const SegmentMotion upper = track_segment(take, {0, 1, 2, 3}, 0), lower = track_segment(take, {4, 5, 6}, 0);

  const auto joint = find_joint(take, upper, lower);

  ASSERT_TRUE(joint);
  const Eigen::Vector3d middle =
      0.5 * (place_at(2, Eigen::Quaterniond::Identity()) + place_at(4, Eigen::Quaterniond::Identity()));
  EXPECT_LT((in_world(upper, joint->in_one_m) - middle).norm(), 0.02);
}

TEST(FunctionalJoint, OfSegmentsThatAreNeverSeenTogetherIsNone) {
  auto take = ball_joint(0.001);
  for (std::size_t f = 0; f < kFrames; ++f) {
    for (std::size_t m = f < kFrames / 2 ? 0 : 4; m < (f < kFrames / 2 ? 4u : 7u); ++m)
      take.places_m[7 * f + m].setConstant(std::numeric_limits<double>::quiet_NaN());
  }

  EXPECT_FALSE(find_joint(take, track_segment(take, {0, 1, 2, 3}, 0), track_segment(take, {4, 5, 6}, 0)));
}

}  // namespace functional_joint_test
}  // namespace mocap::functional
