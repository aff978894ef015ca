#include "pose/running_mean_rotation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kinematics/rotation.h"

namespace mocap::pose {
namespace {

constexpr double kStep_s = 1.0 / 120.0;
const Eigen::Matrix3d kTold = Eigen::Matrix3d::Identity();

// A joint that swings by 0.8 rad about 0.9 rad of the x axis, 1.5 times a second.
Eigen::Quaterniond swung(int step) {
  return kinematics::from_rotation_vector({0.9 + 0.8 * std::sin(9.42 * step * kStep_s), 0.0, 0.0});
}

TEST(RunningMeanRotation, AreTheMiddleOfASwing) {
  RunningMeanRotation turns(1);

  for (int step = 0; step < 480; ++step) turns.update(0, swung(step), kTold, kStep_s);

  const Eigen::Vector3d off = turns.rotation_to_mean(0, kinematics::from_rotation_vector({0.9, 0.0, 0.0}));
  EXPECT_LT(off.norm(), 0.15);
  EXPECT_NEAR(turns.rotation_to_mean(0, kinematics::from_rotation_vector({1.7, 0.0, 0.0})).x(), off.x() - 0.8, 1e-9);
}

TEST(RunningMeanRotation, LeadNowhereWhereNothingToldThem) {
  RunningMeanRotation turns(2);
  const Eigen::Matrix3d about_one_axis = Eigen::Vector3d(1.0, 0.0, 0.0).asDiagonal();

  for (int step = 0; step < 480; ++step) turns.update(0, swung(step), about_one_axis, kStep_s);

  EXPECT_FALSE(turns.known(0));
  EXPECT_EQ(turns.rotation_to_mean(0, swung(0)).norm(), 0.0);
  turns.update(0, swung(0), kTold, kStep_s);
  EXPECT_TRUE(turns.known(0));
  EXPECT_FALSE(turns.known(1));
  turns.reset();
  EXPECT_FALSE(turns.known(0));
}

}  // namespace
}  // namespace mocap::pose
