// Tests of the study's filters (preset `paper`).
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "paper_study/paper_alpha_beta.h"
#include "paper_study/paper_condensation.h"
#include "paper_study/paper_kalman.h"

namespace mocap::paper_study {
namespace paper_filters_test {

static_assert(filter::PointFilter<PaperAlphaBeta, 2>);
static_assert(filter::PointFilter<PaperKalman, 2>);
static_assert(filter::PointFilter<PaperCondensation, 2>);

filter::Seen<2> seen(double x, double y) { return {{x, y}, filter::Matrix<2>::Identity()}; }

TEST(PaperAlphaBeta, ReducesTheErrorToAFifthInEachFrameAfterAChangeOfVelocity) {
  // With alpha = 1 the velocity error decreases by the factor 1 - beta = 0.2 in each frame: e_k = 0.2^k |dv|, for any
  // time step.
  PaperAlphaBeta filter({}, seen(100.0, 200.0));
  const double speed_px = 30.0;
  double expected_px = speed_px;
  for (int k = 1; k <= 6; ++k) {
    filter.predict(0.033 * k);
    EXPECT_NEAR(filter.gate().centre.x() - (100.0 + speed_px * k), -expected_px, 1e-9);
    filter.update(seen(100.0 + speed_px * k, 200.0));
    EXPECT_NEAR(filter.belief().point.x(), 100.0 + speed_px * k, 1e-12);
    expected_px *= 0.2;
  }
}

TEST(PaperAlphaBeta, HasAGateOf40PxIn640x480AndContinuesHiddenUpToTheBorder) {
  PaperAlphaBeta filter({}, seen(600.0, 240.0));
  EXPECT_NEAR(filter.radius_px(), 40.0, 1e-12);
  filter.predict(1.0);
  filter.update(seen(620.0, 240.0));  // 16 px per frame from now on
  filter.predict(1.0);
  EXPECT_NEAR(filter.belief().point.x(), 636.0, 1e-9);
  filter.coast();
  filter.predict(1.0);

  EXPECT_EQ(filter.belief().point.x(), 640.0);
  EXPECT_NEAR(filter.radius_px(), 40.0, 1e-12);
}

/// The same filter as weighted least squares over the whole history. Unknowns: the first velocity and the change of
/// velocity in each step. The first point is known.
Eigen::Vector4d batch(const std::vector<filter::Vector<2>>& points, const std::vector<filter::Vector<2>>& noise) {
  const auto steps = static_cast<Eigen::Index>(points.size()) - 1;
  const Eigen::Index unknowns = 2 + 2 * steps;  // first velocity, then its changes
  filter::Matrix<2> r;
  r << 0.2845, 0.0045, 0.0045, 0.0455;
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(unknowns, unknowns);
  Eigen::VectorXd rhs = Eigen::VectorXd::Zero(unknowns);
  information.topLeftCorner(2, 2) = filter::Matrix<2>::Identity() / 100.0;
  Eigen::MatrixXd place = Eigen::MatrixXd::Zero(2, unknowns), velocity = place;
  velocity.leftCols(2).setIdentity();
  for (Eigen::Index k = 0; k < steps; ++k) {
    place += velocity;  // the noise of a step changes the velocity of the next step
    velocity.middleCols(2 + 2 * k, 2).setIdentity();
    const filter::Vector<2> q = noise[static_cast<std::size_t>(k)];
    information.block(2 + 2 * k, 2 + 2 * k, 2, 2) += q.cwiseInverse().asDiagonal().toDenseMatrix();
    information += place.transpose() * r.inverse() * place;
    rhs += place.transpose() * r.inverse() * (points[static_cast<std::size_t>(k + 1)] - points[0]);
  }
  const Eigen::VectorXd solution = information.ldlt().solve(rhs);
  Eigen::Vector4d state;
  state << points[0] + place * solution, velocity * solution;
  return state;
}

TEST(PaperKalman, AgreesWithLeastSquaresOverTheWholeHistory) {
  filter::Random random(11);
  std::vector<filter::Vector<2>> points{{300.0, 200.0}};
  std::vector<filter::Vector<2>> noise{
      {0.2, 0.2}};  // noise of each step; later it depends on the velocity known two steps before
  PaperKalman filter({}, {points[0], filter::Matrix<2>::Identity()});
  filter::Vector<2> known = filter::Vector<2>::Zero();
  for (int k = 1; k <= 12; ++k) {
    points.push_back(points.back() + filter::Vector<2>(6.0 + random.normal(), -5.0 + random.normal()));
    filter.predict(1.0);
    filter.update({points.back(), filter::Matrix<2>::Identity()});

    const Eigen::Vector4d state = batch(points, noise);

    EXPECT_LT((filter.belief().velocity - state.tail<2>()).norm(), 1e-6);
    noise.push_back((0.06 + 0.013 * known.array().abs()).matrix());
    known = filter.belief().velocity;
  }
}

TEST(PaperKalman, TruncatesPredictionAndGateToWholePixels) {
  PaperKalman filter({}, seen(100.5, 50.5));
  filter.predict(1.0);
  EXPECT_EQ(filter.gate().centre, filter::Vector<2>(100.0, 50.0));
  // P_vv is 100 + 0.2: 100 times its root.
  EXPECT_EQ(filter.radius_px(), std::trunc(100.0 * std::sqrt(100.2)));
  EXPECT_EQ(filter.gate().predicted_covariance(0, 0), filter.radius_px() * filter.radius_px());
}

TEST(PaperKalman, HasASmallerGateAfterTheMarkerWasHidden) {
  PaperKalman filter({}, seen(100.0, 100.0));
  const double x = 100.0;
  for (int k = 1; k <= 20; ++k) {
    filter.predict(1.0);
    filter.update(seen(x + 12.0 * k, x + 9.0 * k));
  }
  filter.predict(1.0);
  const double before_px = filter.radius_px();
  for (int k = 0; k < 15; ++k) {
    filter.coast();
    EXPECT_EQ(filter.belief().point, filter.gate().centre);  // the prediction counts as a measurement
    filter.predict(1.0);
  }
  EXPECT_LT(filter.radius_px(), before_px);
  EXPECT_LT(filter.belief().velocity.x(), 11.0);  // the truncation to whole pixels reduces the velocity
}

TEST(PaperKalman, KeepsABoundedCovarianceForTenThousandFrames) {
  PaperKalman filter({}, seen(320.0, 240.0));
  for (int k = 0; k < 10000; ++k) {
    filter.predict(1.0);
    if (k % 7 == 0) {
      filter.coast();
    } else {
      filter.update(seen(320.0 + 100.0 * std::sin(0.1 * k), 240.0 + 100.0 * std::cos(0.1 * k)));
    }
  }
  const filter::Matrix<2> covariance = filter.belief().covariance;
  EXPECT_EQ(covariance(0, 1), covariance(1, 0));
  EXPECT_LT(covariance.norm(), 0.2845 + 0.0455);  // trace of R, the measurement noise
}

TEST(PaperCondensation, PredictsAboutTheLastMeasuredPosition) {
  // For normally distributed particles, weighting with their own variance v halves v, and a uniform step of up to s
  // adds s^2 / 3. The stationary variance is 2/3 s^2 for each axis.
  filter::Vector<2> mean = filter::Vector<2>::Zero();
  double radius_px = 0.0, n = 0.0;
  for (std::uint64_t seed = 0; seed < 100; ++seed) {
    PaperCondensation filter({{}, seed}, seen(400.0, 150.0));
    for (int k = 0; k < 30; ++k) {
      filter.predict(1.0);
      filter.update(seen(400.0, 150.0));
      if (k < 10) continue;
      mean += filter.gate().centre;
      radius_px += filter.radius_px();
      n += 1.0;
    }
  }

  EXPECT_LT((mean / n - filter::Vector<2>(400.0, 150.0)).norm(), 1.5);
  const double sigma_x_px = std::sqrt(2.0 / 3.0) * 640.0 / 7.5, sigma_y_px = std::sqrt(2.0 / 3.0) * 480.0 / 7.5;
  // Tolerance 12 %: the steps are uniform, not normal, and the first particle always survives the resampling.
  EXPECT_NEAR(radius_px / n, 0.5 * (sigma_x_px + sigma_y_px), 0.12 * radius_px / n);
}

TEST(PaperCondensation, LagsBehindAMovingPointByMoreThanAStepAndStaysWhileHidden) {
  PaperCondensation filter({}, seen(50.0, 240.0));
  double lag_px = 0.0;
  for (int k = 1; k <= 25; ++k) {
    filter.predict(1.0);
    if (k > 5) lag_px += (50.0 + 20.0 * k - filter.gate().centre.x()) / 20.0;
    filter.update(seen(50.0 + 20.0 * k, 240.0));
  }
  // The mean of the particles moves half of the distance in each step: 20 px of the step plus 20 px of lag.
  EXPECT_NEAR(lag_px, 40.0, 8.0);

  filter.predict(1.0);
  filter.coast();

  EXPECT_EQ(filter.belief().point, filter::Vector<2>(550.0, 240.0));
}

TEST(PaperCondensation, GivesTheSameForTheSameSeed) {
  PaperCondensation one({{}, 5}, seen(10.0, 20.0)), same = one, other({{}, 6}, seen(10.0, 20.0));
  one.predict(1.0);
  same.predict(1.0);
  other.predict(1.0);
  EXPECT_EQ(one.gate().centre, same.gate().centre);
  EXPECT_NE(one.gate().centre, other.gate().centre);
}

}  // namespace paper_filters_test
}  // namespace mocap::paper_study
