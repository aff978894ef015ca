#include "pose/running_mean_rotation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "kinematics/rotation.h"

namespace mocap::pose {
namespace running_mean_rotation_test {

constexpr double kStep_s = 1.0 / 120.0;
const Eigen::Matrix3d kFullyObserved = Eigen::Matrix3d::Identity();

// A rotation about the x axis that oscillates by 0.8 rad around 0.9 rad, 1.5 times a second.
Eigen::Quaterniond oscillating(int step) {
  return kinematics::from_rotation_vector({0.9 + 0.8 * std::sin(9.42 * step * kStep_s), 0.0, 0.0});
}

TEST(RunningMeanRotation, IsTheCentreOfAnOscillation) {
  RunningMeanRotation mean(1);

  for (int step = 0; step < 480; ++step) mean.update(0, oscillating(step), kFullyObserved, kStep_s);

  const Eigen::Vector3d off = mean.rotation_to_mean(0, kinematics::from_rotation_vector({0.9, 0.0, 0.0}));
  EXPECT_LT(off.norm(), 0.15);
  EXPECT_NEAR(mean.rotation_to_mean(0, kinematics::from_rotation_vector({1.7, 0.0, 0.0})).x(), off.x() - 0.8, 1e-9);
}

TEST(RunningMeanRotation, IsUnknownWithoutObservedRotation) {
  RunningMeanRotation mean(2);
  const Eigen::Matrix3d about_one_axis = Eigen::Vector3d(1.0, 0.0, 0.0).asDiagonal();

  for (int step = 0; step < 480; ++step) mean.update(0, oscillating(step), about_one_axis, kStep_s);

  EXPECT_FALSE(mean.known(0));
  EXPECT_EQ(mean.rotation_to_mean(0, oscillating(0)).norm(), 0.0);
  mean.update(0, oscillating(0), kFullyObserved, kStep_s);
  EXPECT_TRUE(mean.known(0));
  EXPECT_FALSE(mean.known(1));
  mean.reset();
  EXPECT_FALSE(mean.known(0));
}

}  // namespace running_mean_rotation_test
}  // namespace mocap::pose
