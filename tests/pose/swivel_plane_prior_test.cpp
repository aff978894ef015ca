#include "pose/swivel_plane_prior.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "kinematics/rotation.h"
#include "support/test_body.h"

namespace mocap::pose {
namespace swivel_plane_prior_test {

constexpr double kStep_s = 1.0 / 120.0;
constexpr double kAxisOffset_rad = 0.5;
const Eigen::Vector3d kAxis(std::sin(kAxisOffset_rad), 0.0, -std::cos(kAxisOffset_rad));

std::size_t bone_named(const MarkerSet& set, const std::string& name) {
  std::size_t b = 0;
  while (set.skeleton.bones[b].name != name) ++b;
  return b;
}

// A left elbow bent by `by_rad` about kAxis, with the forearm twisted by `twist_rad` and rotated out of its plane by
// `out_rad`.
Eigen::Quaterniond bent(double by_rad, double twist_rad, double out_rad) {
  const Eigen::Vector3d out(-kAxis.z(), 0.0, kAxis.x());
  return kinematics::from_rotation_vector(out_rad * out) * kinematics::from_rotation_vector(by_rad * kAxis) *
         kinematics::from_rotation_vector({0.0, twist_rad, 0.0});
}

struct Elbow {
  Elbow() : set(test::person("baseline41")), bone(bone_named(set, "LeftLowArm")), planes(set.skeleton) {}

  void bend(double twist_rad, double deviation_rad,
            const Eigen::Matrix3d& observed_fraction = Eigen::Matrix3d::Identity()) {
    for (int i = 0; i < 480; ++i) {
      const double by_rad = 0.7 + 0.4 * std::sin(0.1 * i);
      planes.update(bone, bent(by_rad, twist_rad * std::sin(0.07 * i), deviation_rad * std::sin(0.23 * i)),
                    observed_fraction, kStep_s);
    }
  }

  MarkerSet set;
  std::size_t bone;
  SwivelPlanePrior planes;
};

TEST(SwivelPlanePrior, LearnsThePlaneOfAnElbowForAnyTwistOfTheForearm) {
  Elbow elbow;

  elbow.bend(0.8, 0.0);

  const kinematics::SwivelPlane& plane = elbow.planes.plane(elbow.bone);
  EXPECT_NEAR(std::abs(plane.normal.dot(kAxis)), 1.0, 1e-3);
  EXPECT_NEAR(plane.bone_axis.dot(Eigen::Vector3d::UnitY()), 1.0, 1e-12);
  EXPECT_GT(plane.weight_1_rad2, 1.0 / (0.04 * 0.04));
}

TEST(SwivelPlanePrior, HasTheInformationOfTheDeviationFromThePlane) {
  Elbow elbow;

  elbow.bend(0.0, 0.3);

  const double deviation_rad = 1.0 / std::sqrt(elbow.planes.plane(elbow.bone).weight_1_rad2);
  EXPECT_GT(deviation_rad, 0.1);
  EXPECT_LT(deviation_rad, 0.3);
}

// The twist (axis 1) need not be observed.
TEST(SwivelPlanePrior, IsUnknownUnlessBothRotationsOfTheTipAreObserved) {
  for (int axis = 0; axis < 3; ++axis) {
    Elbow elbow;
    Eigen::Matrix3d observed_fraction = Eigen::Matrix3d::Identity();
    observed_fraction(axis, axis) = 0.3;

    elbow.bend(0.0, 0.0, observed_fraction);

    EXPECT_EQ(elbow.planes.plane(elbow.bone).weight_1_rad2 > 0.0, axis == 1) << axis;
  }
}

TEST(SwivelPlanePrior, IsUnknownForBallJoints) {
  Elbow elbow;
  const std::size_t shoulder = bone_named(elbow.set, "LeftUpArm");

  for (int i = 0; i < 480; ++i)
    elbow.planes.update(shoulder, bent(1.0, 0.0, 0.0), Eigen::Matrix3d::Identity(), kStep_s);

  EXPECT_EQ(elbow.planes.plane(shoulder).weight_1_rad2, 0.0);
}

// A lower leg lies along z. Its twist has a range in both directions and is no hinge axis.
TEST(SwivelPlanePrior, OfAKneeContainsTheLegAndTheBendingDirection) {
  Elbow elbow;
  const std::size_t knee = bone_named(elbow.set, "LeftLowLeg");

  for (int i = 0; i < 480; ++i)
    elbow.planes.update(knee, kinematics::from_rotation_vector({0.0, 0.8, 0.0}), Eigen::Matrix3d::Identity(), kStep_s);

  const kinematics::SwivelPlane& plane = elbow.planes.plane(knee);
  EXPECT_NEAR(plane.bone_axis.dot(Eigen::Vector3d::UnitZ()), 1.0, 1e-12);
  EXPECT_NEAR(std::abs(plane.normal.dot(Eigen::Vector3d::UnitY())), 1.0, 1e-9);
}

TEST(SwivelPlanePrior, IsKnownAfterHalfASecond) {
  Elbow elbow;
  const auto bend_for = [&](double time_s) {
    for (double at_s = 0.0; at_s < time_s; at_s += kStep_s)
      elbow.planes.update(elbow.bone, bent(0.8, 0.0, 0.0), Eigen::Matrix3d::Identity(), kStep_s);
  };

  bend_for(0.4);
  EXPECT_EQ(elbow.planes.plane(elbow.bone).weight_1_rad2, 0.0);

  bend_for(0.3);
  EXPECT_GT(elbow.planes.plane(elbow.bone).weight_1_rad2, 0.0);
}

TEST(SwivelPlanePrior, IsUnknownForAnElbowThatHardlyBends) {
  Elbow elbow;
  for (int i = 0; i < 480; ++i)
    elbow.planes.update(elbow.bone, bent(0.1, 0.0, 0.0), Eigen::Matrix3d::Identity(), kStep_s);

  EXPECT_EQ(elbow.planes.plane(elbow.bone).weight_1_rad2, 0.0);
}

TEST(SwivelPlanePrior, IsForgottenByAReset) {
  Elbow elbow;
  elbow.bend(0.0, 0.0);

  elbow.planes.reset();
  EXPECT_EQ(elbow.planes.plane(elbow.bone).weight_1_rad2, 0.0);

  // The elbow of the next subject has the nominal axis, and its plane needs the same time to be known.
  const auto bend_for = [&](double time_s) {
    for (double at_s = 0.0; at_s < time_s; at_s += kStep_s)
      elbow.planes.update(elbow.bone, kinematics::from_rotation_vector({0.0, 0.0, -0.6}), Eigen::Matrix3d::Identity(),
                          kStep_s);
  };
  bend_for(0.4);
  EXPECT_EQ(elbow.planes.plane(elbow.bone).weight_1_rad2, 0.0);
  bend_for(0.3);
  EXPECT_NEAR(std::abs(elbow.planes.plane(elbow.bone).normal.z()), 1.0, 1e-9);
}

// The gradient in the equations is the derivative of the cost.
TEST(SwivelPlanePrior, MovesAnElbowIntoThePlaneAndKeepsItsBend) {
  const MarkerSet set = test::person("baseline41");
  const std::size_t bone = bone_named(set, "LeftLowArm");
  kinematics::PoseFit pose(set, kinematics::PoseFit::Lengths::Fixed);
  std::vector<Pose> locals(pose.locals().begin(), pose.locals().end());
  locals[bone].rotation = bent(0.8, 0.0, 0.2);
  pose.set_locals(locals);
  pose.set_swivel_plane(bone, {kAxis, Eigen::Vector3d::UnitY(), 1e6});
  std::vector<kinematics::Observation> seen;  // all markers except those of forearm and hand
  for (const kinematics::Observation& one : test::see(pose)) {
    const auto on = static_cast<std::size_t>(set.markers[static_cast<std::size_t>(one.marker)].bone);
    if (on != bone && static_cast<std::size_t>(set.skeleton.bones[on].parent) != bone) seen.push_back(one);
  }
  const std::vector<double> prior_sigma_rad(set.skeleton.bones.size(), 0.5);

  const kinematics::PoseFitResult result =
      pose.solve(seen, {.limit_sigma_rad = 10.0, .prior_sigma_rad = prior_sigma_rad}, 30);

  EXPECT_TRUE(result.converged);
  const Eigen::Vector3d tip = pose.locals()[bone].rotation * Eigen::Vector3d::UnitY();
  EXPECT_NEAR(tip.dot(kAxis), 0.0, 1e-3);
  EXPECT_NEAR(std::acos(tip.y()), 0.8, 0.05);
}

}  // namespace swivel_plane_prior_test
}  // namespace mocap::pose
