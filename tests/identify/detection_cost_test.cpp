#include "identify/detection_cost.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace mocap::identify {
namespace detection_cost_test {

// Minus the log likelihood of a residual in standard deviations, relative to a residual of 0.
double residual_cost(double sigmas) {
  const auto density = [](double x) { return std::exp(-0.5 * x * x) / std::sqrt(2.0 * std::numbers::pi); };
  return -std::log(density(sigmas) / density(0.0));
}

TEST(MissedDetectionCost, EqualsTheCostOfAResidualOfFourStandardDeviations) {
  constexpr double kRounding = 1e-12;  // no unit: rounding of exponential and logarithm

  EXPECT_NEAR(kMissedDetectionCost, residual_cost(4.0), kRounding);
  EXPECT_LT(residual_cost(3.9), kMissedDetectionCost);
  EXPECT_GT(residual_cost(4.1), kMissedDetectionCost);
}

}  // namespace detection_cost_test
}  // namespace mocap::identify
