#include "pose/joint_drift_covariance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "pose/skeleton_tracker.h"
#include "support/test_body.h"

namespace mocap::pose {
namespace joint_drift_covariance_test {

constexpr double kStep_s = 1.0 / 120.0;
constexpr double kInitialSigma_rad = 0.15;

// Standard deviation of the bone's rotation about an axis, rad.
double sigma_rad(const JointDriftCovariance& drift, int axis) {
  const Eigen::Matrix3d weight = drift.prior_information(0, kInitialSigma_rad, 0.0);
  return 1.0 / std::sqrt(weight(axis, axis));
}

TEST(JointDriftCovariance, GrowsOnlyAboutTheUnobservedAxis) {
  JointDriftCovariance drift(1);
  const Eigen::Matrix3d observed_fraction = Eigen::Vector3d(1.0, 0.0, 1.0).asDiagonal();

  for (int set = 0; set < 36; ++set) drift.step(0, observed_fraction, kStep_s);

  // 0.3 s at 2.5 rad/s, added to the initial standard deviation.
  EXPECT_NEAR(sigma_rad(drift, 0), kInitialSigma_rad, 1e-9);
  EXPECT_NEAR(sigma_rad(drift, 1), kInitialSigma_rad + 0.75, 1e-9);
  EXPECT_NEAR(sigma_rad(drift, 2), kInitialSigma_rad, 1e-9);
}

TEST(JointDriftCovariance, IsResetInTheSetThatObservesTheRotation) {
  JointDriftCovariance drift(1);
  for (int set = 0; set < 60; ++set) drift.step(0, Eigen::Matrix3d::Zero(), kStep_s);

  drift.step(0, Eigen::Matrix3d::Identity(), kStep_s);

  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(sigma_rad(drift, axis), kInitialSigma_rad, 1e-9);
}

TEST(JointDriftCovariance, IsBounded) {
  JointDriftCovariance drift(1);

  for (int set = 0; set < 10'000; ++set) drift.step(0, Eigen::Matrix3d::Zero(), kStep_s);

  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(sigma_rad(drift, axis), kMaxJointDrift_rad, 1e-9);
}

// One marker of a hand observes the direction of the hand. After half a second it does not determine the position of
// the other marker.
TEST(SkeletonTracker, IncreasesTheCovarianceOfAHiddenMarkerOfAnObservedHand) {
  const MarkerSet set = test::person("baseline41");
  kinematics::PoseFit truth(set, kinematics::PoseFit::Lengths::Fixed);
  SkeletonTracker body(set, {});
  const std::vector<kinematics::Observation> all = test::see(truth);
  const Timestamp begun = from_ns(1'000'000'000);
  ASSERT_TRUE(body.start(all, begun));
  std::size_t hidden = 0;
  while (set.markers[hidden].name != "LHandIn") ++hidden;
  std::vector<kinematics::Observation> seen = all;
  std::erase_if(seen, [&](const kinematics::Observation& one) { return one.marker == static_cast<int>(hidden); });

  std::vector<double> spread_m;
  for (int step = 1; step <= 60; ++step) {
    const Timestamp at = begun + from_s(step * kStep_s);
    body.predict(at);
    (void)body.update(step == 1 ? all : seen);
    ASSERT_TRUE(body.compute_covariances(step == 1 ? all : seen, at));
    spread_m.push_back(std::sqrt(body.predicted_covariance(hidden).trace()));
    body.commit(step == 1 ? all : seen);
  }

  EXPECT_LT(spread_m.front(), 0.02);
  EXPECT_GT(spread_m.back(), 0.03);  // the hidden marker lies on a circle with a radius of about 30 mm
}

}  // namespace joint_drift_covariance_test
}  // namespace mocap::pose
