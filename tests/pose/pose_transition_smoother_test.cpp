#include "pose/pose_transition_smoother.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "kinematics/rotation.h"

namespace mocap::pose {
namespace pose_transition_smoother_test {

constexpr double kStep_s = 0.01;

std::vector<Pose> at(double x_m, double angle_rad) {
  return {{{x_m, 0.0, 0.0}, Eigen::Quaterniond::Identity()},
          {{0.0, 0.3, 0.0}, kinematics::from_rotation_vector({0.0, 0.0, angle_rad})}};
}

double angle_of(std::span<const Pose> poses) { return kinematics::rotation_vector(poses[1].rotation).z(); }

TEST(PoseTransitionSmoother, ChangesNothingWhileTheSameMarkersObserveABone) {
  PoseTransitionSmoother smoother(2);
  const std::vector<std::uint8_t> same{0, 0};
  for (int i = 0; i < 20; ++i) {
    const double angle = i == 10 ? 1.0 : 0.01 * i;

    const auto shown = smoother.step(at(0.1 * i, angle), at(0.0, 0.0), same, kStep_s);

    EXPECT_NEAR(shown[0].position.x(), 0.1 * i, 1e-12);
    EXPECT_NEAR(angle_of(shown), angle, 1e-12);
  }
}

TEST(PoseTransitionSmoother, EasesAJumpWhenOtherMarkersObserveABone) {
  PoseTransitionSmoother smoother(2);
  for (int i = 0; i < 50; ++i)
    (void)smoother.step(at(0.0, 0.0), at(0.0, 0.0), std::vector<std::uint8_t>{0, 0}, kStep_s);
  double last = 0.0, before = 0.0, most = 0.0;

  double shown = angle_of(smoother.step(at(0.0, 0.8), at(0.0, 0.0), std::vector<std::uint8_t>{1, 1}, kStep_s));
  EXPECT_NEAR(shown, 0.0, 1e-9);
  for (int i = 1; i <= 30; ++i) {
    before = last;
    last = shown;
    shown = angle_of(smoother.step(at(0.0, 0.8), at(0.0, 0.8), std::vector<std::uint8_t>{0, 0}, kStep_s));
    most = std::max(most, std::abs(shown - 2.0 * last + before));
    // The remaining offset of a critically damped spring: 0.8 (1 + t / 40 ms) e^(-t / 40 ms).
    const double t = i * kStep_s / 0.04;
    EXPECT_NEAR(0.8 - shown, 0.8 * (1.0 + t) * std::exp(-t), 1e-6) << i;
  }
  EXPECT_LT(most, 0.8 * std::pow(kStep_s / 0.04, 2));
}

// The prediction is far from the new pose, and the last published pose is nearer: the easing starts from the latter.
TEST(PoseTransitionSmoother, StartsFromTheLastPublishedPoseIfThatIsNearer) {
  PoseTransitionSmoother smoother(2);
  for (int i = 0; i < 50; ++i)
    (void)smoother.step(at(0.0, 0.0), at(0.0, 0.0), std::vector<std::uint8_t>{0, 0}, kStep_s);

  const auto shown = smoother.step(at(0.01, 0.05), at(0.6, 1.4), std::vector<std::uint8_t>{1, 1}, kStep_s);

  EXPECT_NEAR(angle_of(shown), 0.0, 1e-9);
  EXPECT_NEAR(shown[0].position.x(), 0.0, 1e-9);
  for (int i = 0; i < 20; ++i) {
    const auto later = smoother.step(at(0.01, 0.05), at(0.01, 0.05), std::vector<std::uint8_t>{0, 0}, kStep_s);
    EXPECT_GE(angle_of(later), -1e-9) << i;
    EXPECT_LE(angle_of(later), 0.05 + 1e-9) << i;
  }
}

TEST(PoseTransitionSmoother, DoesNotEaseUsualPredictionErrors) {
  PoseTransitionSmoother smoother(2);
  for (int i = 0; i < 200; ++i) {
    const double error_rad = 0.03 * std::sin(1.3 * i);

    const auto shown =
        smoother.step(at(0.0, error_rad), at(0.0, 0.0),
                      std::vector<std::uint8_t>{0, i > 100 ? std::uint8_t{1} : std::uint8_t{0}}, kStep_s);

    EXPECT_NEAR(angle_of(shown), error_rad, 1e-12);
  }
}

}  // namespace pose_transition_smoother_test
}  // namespace mocap::pose
