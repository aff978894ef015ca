#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "kinematics/rotation.h"

namespace mocap::kinematics {
namespace {

TEST(TurnBetween, TakesOneDirectionToTheOtherByTheShortestTurn) {
  std::mt19937 random(3);
  std::normal_distribution<double> any;
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d from(any(random), any(random), any(random)), to(any(random), any(random), any(random));

    const Eigen::Quaterniond turn = rotation_between(from, to);

    EXPECT_NEAR(turn.norm(), 1.0, 1e-12);
    EXPECT_LT((turn * from.normalized() - to.normalized()).norm(), 1e-12);
    const double angle = std::acos(from.normalized().dot(to.normalized()));
    EXPECT_NEAR(rotation_vector(turn).norm(), angle, 1e-7);
  }
}

TEST(TurnBetween, TakesADirectionToNearlyItsOpposite) {
  const Eigen::Vector3d from(0.3, -2.0, 0.7);
  for (const double off : {0.0, 1e-16, 1e-9, 1e-7, 1e-5, 1e-3}) {
    const Eigen::Vector3d to = -5.0 * from + off * Eigen::Vector3d(1.0, 2.0, -1.0);

    const Eigen::Quaterniond turn = rotation_between(from, to);

    EXPECT_NEAR(turn.norm(), 1.0, 1e-9) << off;
    EXPECT_LT((turn * from.normalized() - to.normalized()).norm(), 1e-5) << off;
    EXPECT_NEAR(rotation_vector(turn).norm(), std::numbers::pi, 1e-2) << off;
  }
}

}  // namespace
}  // namespace mocap::kinematics
