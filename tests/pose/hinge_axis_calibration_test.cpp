#include "pose/hinge_axis_calibration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "kinematics/rotation.h"
#include "pose/skeleton_tracker.h"
#include "support/test_body.h"

namespace mocap::pose {
namespace hinge_axis_calibration_test {

constexpr double kStep_s = 1.0 / 120.0;

std::size_t bone_named(const MarkerSet& set, const std::string& name) {
  std::size_t b = 0;
  while (set.skeleton.bones[b].name != name) ++b;
  return b;
}

// A left elbow bent by `by_rad` about an axis that is rotated by `axis_offset_rad` about the arm from the nominal axis.
Eigen::Quaterniond bent(double by_rad, double axis_offset_rad) {
  return kinematics::from_rotation_vector(by_rad *
                                          Eigen::Vector3d(std::sin(axis_offset_rad), 0.0, -std::cos(axis_offset_rad)));
}

TEST(HingeAxisCalibration, LearnsTheAxisOffsetOfABendingElbow) {
  const MarkerSet set = test::person("baseline41");
  const std::size_t elbow = bone_named(set, "LeftLowArm");
  HingeAxisCalibration axes(set.skeleton);

  for (int i = 0; i < 120; ++i) {
    const double by_rad = 0.5 + 0.4 * std::sin(0.1 * i);
    (void)axes.update(elbow, bent(by_rad, 0.5), Eigen::Matrix3d::Identity(), kStep_s);
  }

  // The nominal axis has the weight of a tenth of a second.
  EXPECT_NEAR(axes.axis_offset_rad(elbow), 0.5, 0.08);
  const Eigen::Vector3d nominal_rotation =
      axes.nominal_from_calibrated(elbow) * kinematics::rotation_vector(bent(0.9, axes.axis_offset_rad(elbow)));
  EXPECT_TRUE(nominal_rotation.isApprox(Eigen::Vector3d(0.0, 0.0, -0.9), 1e-9)) << nominal_rotation.transpose();
}

TEST(HingeAxisCalibration, LearnsTheOppositeOffsetOfTheRightElbow) {
  const MarkerSet set = test::person("baseline41");
  const std::size_t elbow = bone_named(set, "RightLowArm");
  HingeAxisCalibration axes(set.skeleton);

  for (int i = 0; i < 120; ++i) {
    const Eigen::Quaterniond rotation =
        kinematics::from_rotation_vector({0.9 * std::sin(-0.4), 0.0, 0.9 * std::cos(0.4)});
    (void)axes.update(elbow, rotation, Eigen::Matrix3d::Identity(), kStep_s);
  }

  const Eigen::Vector3d nominal_rotation =
      axes.nominal_from_calibrated(elbow) * Eigen::Vector3d(0.9 * std::sin(-0.4), 0.0, 0.9 * std::cos(0.4));
  EXPECT_NEAR(nominal_rotation.x(), 0.0, 0.06);
  EXPECT_GT(nominal_rotation.z(), 0.89);
}

TEST(HingeAxisCalibration, LearnsNothingFromUnobservedAxesAndFromBallJoints) {
  const MarkerSet set = test::person("baseline41");
  const std::size_t elbow = bone_named(set, "LeftLowArm"), shoulder = bone_named(set, "LeftUpArm");
  HingeAxisCalibration axes(set.skeleton);
  Eigen::Matrix3d minor_axis_unobserved = Eigen::Matrix3d::Identity();
  minor_axis_unobserved(0, 0) = 0.3;

  for (int i = 0; i < 120; ++i) {
    EXPECT_FALSE(axes.update(elbow, bent(1.0, 0.5), minor_axis_unobserved, kStep_s));
    EXPECT_FALSE(axes.update(shoulder, bent(1.0, 0.5), Eigen::Matrix3d::Identity(), kStep_s));
  }

  EXPECT_EQ(axes.axis_offset_rad(elbow), 0.0);
  EXPECT_TRUE(axes.nominal_from_calibrated(shoulder).isIdentity());
}

TEST(HingeAxisCalibration, ReturnsToTheNominalAxisAfterAReset) {
  const MarkerSet set = test::person("baseline41");
  const std::size_t elbow = bone_named(set, "LeftLowArm");
  HingeAxisCalibration axes(set.skeleton);
  for (int i = 0; i < 60; ++i) (void)axes.update(elbow, bent(1.0, 0.5), Eigen::Matrix3d::Identity(), kStep_s);

  axes.reset();

  EXPECT_EQ(axes.axis_offset_rad(elbow), 0.0);
}

// The cost ranks label hypotheses: an elbow that bends about the subject's axis must not have the cost of a wrong
// label.
TEST(SkeletonTracker, HasALowCostForAnElbowThatBendsAboutTheLearnedAxis) {
  const MarkerSet set = test::person("baseline41");
  const std::size_t elbow = bone_named(set, "LeftLowArm");
  kinematics::PoseFit truth(set, kinematics::PoseFit::Lengths::Fixed);
  SkeletonTracker body(set, {});
  std::vector<Pose> locals(truth.locals().begin(), truth.locals().end());
  std::vector<double> costs;

  for (int step = 0; step <= 180; ++step) {
    const Timestamp at = from_ns(1'000'000'000) + from_s(step * kStep_s);
    locals[elbow].rotation = bent(0.7 - 0.7 * std::cos(0.0524 * step), 0.52);
    truth.set_locals(locals);
    const std::vector<kinematics::Observation> seen = test::see(truth);
    if (!body.is_tracking()) {
      ASSERT_TRUE(body.start(seen, at));
      continue;
    }
    body.predict(at);
    (void)body.update(seen);
    costs.push_back(body.evaluate_hypothesis(seen).cost);
    body.commit(seen);
  }

  EXPECT_LT(costs.back(), 2.0);  // half squared standard deviations; 9 with the nominal axis
}

}  // namespace hinge_axis_calibration_test
}  // namespace mocap::pose
