#include "pose/pose_smoother.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "kinematics/rotation.h"

namespace mocap::pose {
namespace pose_smoother_test {

constexpr double kStep_s = 1.0 / 120.0;

std::vector<Pose> at(double x_m, double angle_rad) {
  return {{{x_m, 0.0, 1.0}, Eigen::Quaterniond::Identity()},
          {{0.0, 0.3, 0.0}, kinematics::from_rotation_vector({0.0, angle_rad, 0.0})}};
}

double angle_of(std::span<const Pose> poses) { return kinematics::rotation_vector(poses[1].rotation).y(); }

TEST(PoseSmoother, ChangesNothingIfDisabled) {
  PoseSmoother smoother({}, 2);
  for (int i = 0; i < 10; ++i) {
    const auto shown = smoother.step(at(0.1 * i, 0.2 * i), kStep_s);

    EXPECT_EQ(shown[0].position.x(), 0.1 * i);
    EXPECT_NEAR(angle_of(shown), 0.2 * i, 1e-12);
    EXPECT_EQ(smoother.delay_s(), 0.0);
  }
}

TEST(PoseSmoother, HalvesTheJitterOfAPoseAtRest) {
  PoseSmoother smoother({.min_cutoff_hz = 2.0, .beta = 0.1}, 2);
  std::mt19937 random(1);
  std::normal_distribution<double> noise(0.0, 0.001);
  double raw2 = 0.0, shown2 = 0.0;
  for (int i = 0; i < 2000; ++i) {
    const double x = noise(random), angle = noise(random);
    const auto shown = smoother.step(at(x, angle), kStep_s);
    if (i < 100) continue;
    raw2 += x * x + angle * angle;
    shown2 += std::pow(shown[0].position.x(), 2) + std::pow(angle_of(shown), 2);
  }

  EXPECT_LT(shown2, 0.25 * raw2);
}

// A motion at constant velocity lags by velocity times the delay of a first-order low-pass.
TEST(PoseSmoother, HasTheReportedDelay) {
  for (const double beta : {0.0, 0.5}) {
    PoseSmoother smoother({.min_cutoff_hz = 2.0, .beta = beta}, 2);
    double x = 0.0, shown_x = 0.0;
    for (int i = 0; i < 1200; ++i) {
      x = 0.8 * i * kStep_s;
      shown_x = smoother.step(at(x, 0.0), kStep_s)[0].position.x();
    }

    const double cutoff_hz = 2.0 + beta * 0.8;
    EXPECT_NEAR((x - shown_x) / 0.8, 1.0 / (2.0 * std::numbers::pi * cutoff_hz), 1e-4);
    // The mean of the root's position, which moves, and two rotations, which are at rest.
    const double at_rest_s = 1.0 / (2.0 * std::numbers::pi * 2.0);
    EXPECT_NEAR(smoother.delay_s(), (2.0 * at_rest_s + (x - shown_x) / 0.8) / 3.0, 1e-4);
  }
}

TEST(PoseSmoother, InterpolatesAlongTheShorterRotation) {
  PoseSmoother smoother({.min_cutoff_hz = 2.0, .beta = 0.0}, 2);
  (void)smoother.step(at(0.0, 3.1), kStep_s);

  const auto shown = smoother.step(at(0.0, -3.1), kStep_s);

  EXPECT_GT(std::abs(angle_of(shown)), 3.1);
}

}  // namespace pose_smoother_test
}  // namespace mocap::pose
