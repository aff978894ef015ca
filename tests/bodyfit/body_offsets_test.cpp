#include "bodyfit/body_offsets.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <span>
#include <vector>

#include "support/test_body.h"

namespace mocap::bodyfit {
namespace body_offsets_test {

using Eigen::Vector3d;

TEST(BodyOffsets, OfAMarkerSetAreThoseThatWereApplied) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  MarkerSet set = test::person("baseline41");
  BodyOffsets offsets;
  for (std::size_t b = 0; b < set.skeleton.bones.size(); ++b)
    offsets.bones_m.emplace_back(normal(random), normal(random), normal(random));
  for (std::size_t m = 0; m < set.markers.size(); ++m)
    offsets.markers_m.emplace_back(normal(random), normal(random), normal(random));

  apply_offsets(offsets, set);

  EXPECT_EQ(set.skeleton.bones[3].rest_offset_m, offsets.bones_m[3]);
  EXPECT_EQ(set.markers[40].offset_m, offsets.markers_m[40]);
  EXPECT_EQ(offsets_of(set).bones_m, offsets.bones_m);
  EXPECT_EQ(offsets_of(set).markers_m, offsets.markers_m);
}

TEST(BodyOffsets, OfAnotherSkeletonAreABug) {
  MarkerSet set = test::person("baseline41");
  BodyOffsets offsets = offsets_of(set);
  offsets.markers_m.pop_back();

  EXPECT_DEATH(apply_offsets(offsets, set), "violated precondition");
}

TEST(BodyInstant, IsEmptyInRestPose) {
  const MarkerSet set = test::person("baseline41");
  kinematics::PoseFit rest(set, kinematics::PoseFit::Lengths::Fixed);
  rest.place({set.skeleton.bones[0].rest_offset_m, Eigen::Quaterniond::Identity()});

  const BodyInstant instant = empty_instant(set);

  ASSERT_EQ(instant.seen_m.size(), set.markers.size());
  ASSERT_EQ(instant.trust.size(), set.markers.size());
  for (const Vector3d& seen : instant.seen_m) EXPECT_FALSE(seen.allFinite());
  ASSERT_EQ(instant.locals.size(), set.skeleton.bones.size());
  ASSERT_EQ(instant.at_rest.size(), set.skeleton.bones.size());
  for (std::size_t b = 0; b < instant.locals.size(); ++b) {
    EXPECT_LT((instant.locals[b].position - rest.locals()[b].position).norm(), 1e-12);  // m: rounding
    EXPECT_LT(test::angle_between(instant.locals[b].rotation, rest.locals()[b].rotation), 1e-12);
    EXPECT_EQ(instant.at_rest[b], 0);
  }
}

TEST(PoseDistance, IsTheSumOfTheSquaredSinesOfHalfTheJointAngles) {
  const auto about_x = [](double angle_rad) {
    return Pose{Eigen::Vector3d::Zero(), Eigen::Quaterniond(Eigen::AngleAxisd(angle_rad, Eigen::Vector3d::UnitX()))};
  };
  const std::vector<Pose> rest{about_x(0.0), about_x(0.0), about_x(0.0)},
      bent{about_x(2.0), about_x(0.6), about_x(1.0)};

  EXPECT_NEAR(pose_distance(rest, bent), std::pow(std::sin(0.3), 2) + std::pow(std::sin(0.5), 2), 1e-12);
  EXPECT_NEAR(pose_distance(std::span(rest).first(1), std::span(bent).first(1)), std::pow(std::sin(1.0), 2), 1e-12);
}

}  // namespace body_offsets_test
}  // namespace mocap::bodyfit
