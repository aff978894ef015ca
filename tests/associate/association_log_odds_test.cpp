#include "associate/single_view/association_log_odds.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace mocap::associate {
namespace association_log_odds_test {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Two views with perpendicular directions and 200 px per metre.
struct TwoViews {
  ViewObservation a, b;
  Vector3d ahead_m = Vector3d::Zero();
  Matrix3d covariance_m2;

  TwoViews() {
    a.px_from_m << 200.0, 0.0, 0.0, 0.0, 0.0, 200.0;
    b.px_from_m << 0.0, 200.0, 0.0, 0.0, 0.0, 200.0;
    a.off_px = b.off_px = Vector2d::Zero();
    a.sigma_px = 0.4;
    b.sigma_px = 0.5;
    a.clutter_density_1_px2 = 2e-5;
    b.clutter_density_1_px2 = 3e-5;
    covariance_m2 << 1e-4, 2e-5, 0.0, 2e-5, 2e-4, 1e-5, 0.0, 1e-5, 1.5e-4;
  }
  double log_odds() const { return pair_log_odds(a, b, ahead_m, covariance_m2); }
};

double density(const Vector2d& off_px, double sigma_px) {
  const double variance = sigma_px * sigma_px;
  return std::exp(-0.5 * off_px.squaredNorm() / variance) / (2.0 * std::numbers::pi * variance);
}

/// The log odds by numerical integration: densities of both blobs together and of each blob alone, summed over the
/// positions of the marker.
double log_odds_by_sum(const TwoViews& two) {
  constexpr int kSteps = 80;
  constexpr double kReach = 5.0;  // standard deviations
  const Matrix3d root = two.covariance_m2.llt().matrixL();
  double both = 0.0, a_alone = 0.0, b_alone = 0.0;
  const double step = 2.0 * kReach / kSteps;
  for (int i = 0; i <= kSteps; ++i) {
    for (int j = 0; j <= kSteps; ++j) {
      for (int k = 0; k <= kSteps; ++k) {
        const Vector3d unit = Vector3d(i, j, k) * step - Vector3d::Constant(kReach);
        const double prior =
            std::exp(-0.5 * unit.squaredNorm()) * std::pow(step, 3) / std::pow(2.0 * std::numbers::pi, 1.5);
        const Vector3d place_m = two.ahead_m + root * unit;
        const double by_a = density(two.a.off_px - two.a.px_from_m * place_m, two.a.sigma_px);
        const double by_b = density(two.b.off_px - two.b.px_from_m * place_m, two.b.sigma_px);
        both += prior * by_a * by_b;
        a_alone += prior * by_a;
        b_alone += prior * by_b;
      }
    }
  }
  const double others = std::max({a_alone * two.b.clutter_density_1_px2, b_alone * two.a.clutter_density_1_px2,
                                  two.a.clutter_density_1_px2 * two.b.clutter_density_1_px2});
  return std::log(both / others);
}

TEST(AssociationLogOdds, EqualANumericalSumOverAllPositions) {
  TwoViews two;
  EXPECT_NEAR(two.log_odds(), log_odds_by_sum(two), 0.01);

  two.a.off_px = {0.3, 0.4};
  two.b.off_px = {-0.5, -0.2};
  two.ahead_m = {0.008, -0.012, 0.005};
  EXPECT_NEAR(two.log_odds(), log_odds_by_sum(two), 0.01);
}

TEST(AssociationLogOdds, FallIfTheRaysDoNotMeet) {
  TwoViews near, far;
  far.a.off_px = {0.0, 1.2};
  far.b.off_px = {0.0, -1.2};

  // The heights differ by 2.4 px with a standard deviation of 0.64 px: the log density falls by 3.75^2 / 2.
  EXPECT_NEAR(near.log_odds() - far.log_odds(), 0.5 * 2.4 * 2.4 / (0.16 + 0.25), 0.3);
}

TEST(AssociationLogOdds, FallWithTheUncertaintyOfTheMarkerAndWithClutter) {
  TwoViews sure, unsure, crowded;
  unsure.covariance_m2 *= 100.0;
  crowded.a.clutter_density_1_px2 *= 50.0;
  crowded.b.clutter_density_1_px2 *= 50.0;

  EXPECT_GT(sure.log_odds(), unsure.log_odds() + 2.0);
  EXPECT_NEAR(sure.log_odds(), crowded.log_odds() + std::log(50.0), 1e-9);
}

}  // namespace association_log_odds_test
}  // namespace mocap::associate
