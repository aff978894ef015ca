#include "filter/isotropic_kalman.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "filter/random.h"

namespace mocap::filter {
namespace isotropic_kalman_test {

/// Settings without adaptation, except for innovations that are larger than expected.
IsotropicKalmanSettings fixed_noise(double acceleration, double initial_speed) {
  IsotropicKalmanSettings settings;
  settings.acceleration_u_s2 = acceleration;
  settings.least_noise_scale = 1.0;
  settings.max_noise_scale = 1.0;
  settings.initial_speed_u_s = initial_speed;
  return settings;
}

/// The estimate on one axis by weighted least squares over the whole history. The unknowns are the first position and
/// velocity, and the process noise of each step.
Eigen::Vector2d least_squares(const std::vector<double>& seen, double variance, double dt,
                              const IsotropicKalmanSettings& settings, Eigen::Matrix2d& covariance) {
  const auto steps = static_cast<int>(seen.size()) - 1;
  const int unknowns = 2 + 2 * steps;
  Eigen::Matrix2d noise;
  noise << dt * dt / 3.0, dt / 2.0, dt / 2.0, 1.0;
  noise *= std::pow(settings.acceleration_u_s2 * dt, 2);
  Eigen::Matrix2d transition;
  transition << 1.0, dt, 0.0, 1.0;
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(unknowns, unknowns);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(unknowns);
  Eigen::MatrixXd state = Eigen::MatrixXd::Zero(2, unknowns);
  state.leftCols(2).setIdentity();
  information(1, 1) += 1.0 / std::pow(settings.initial_speed_u_s, 2);
  for (int k = 0; k <= steps; ++k) {
    if (k > 0) {
      state = (transition * state).eval();
      state.block(0, 2 * k, 2, 2).setIdentity();
      information.block(2 * k, 2 * k, 2, 2) += noise.inverse();
    }
    information += state.row(0).transpose() * state.row(0) / variance;
    right += state.row(0).transpose() * seen[static_cast<std::size_t>(k)] / variance;
  }
  const Eigen::MatrixXd all = information.inverse();
  covariance = state * all * state.transpose();
  return state * (all * right);
}

TEST(IsotropicKalman, AgreesWithLeastSquaresOverTheWholeHistory) {
  Random random(11);
  const double dt = 0.04;
  const double variance = 0.25;
  const IsotropicKalmanSettings settings = fixed_noise(30.0, 20.0);
  std::vector<double> x{1.0};
  std::vector<double> y{-2.0};
  IsotropicKalman<2> kalman(settings, {x[0], y[0]}, variance);
  for (int k = 1; k <= 20; ++k) {
    // A fifth of the expected deviation, so that the noise does not adapt.
    x.push_back(1.0 + 0.3 * k + 0.1 * random.normal());
    y.push_back(-2.0 - 0.2 * k + 0.1 * random.normal());
    kalman.predict(dt);
    kalman.update({x.back(), y.back()}, variance);

    Eigen::Matrix2d covariance;
    const Eigen::Vector2d on_x = least_squares(x, variance, dt, settings, covariance);
    const Eigen::Vector2d on_y = least_squares(y, variance, dt, settings, covariance);

    const Motion<2>& motion = kalman.motion();
    EXPECT_NEAR(motion.point.x(), on_x[0], 1e-9);
    EXPECT_NEAR(motion.velocity.x(), on_x[1], 1e-8);
    EXPECT_NEAR(motion.point.y(), on_y[0], 1e-9);
    EXPECT_NEAR(motion.velocity.y(), on_y[1], 1e-8);
    EXPECT_NEAR(motion.pp, covariance(0, 0), 1e-10);
    EXPECT_NEAR(motion.pv, covariance(0, 1), 1e-9);
    EXPECT_NEAR(motion.vv, covariance(1, 1), 1e-8);
  }
}

TEST(IsotropicKalman, GivesThePosteriorComputedByHand) {
  // By hand: P = [1 0; 0 4] at first; dt = 0.5, W = (2 x 0.5)^2 = 1.
  // pp = 1 + 0.25 x 4 + 0.25 / 3 = 25/12, pv = 0.5 x 4 + 0.5 / 2 = 9/4, vv = 4 + 1 = 5.
  // S = 25/12 + 11/12 = 3: gains 25/36 and 3/4; the innovation 0.6 is less than sqrt(3).
  const IsotropicKalmanSettings settings = fixed_noise(2.0, 2.0);
  IsotropicKalman<2> kalman(settings, {0.0, 0.0}, 1.0);

  kalman.predict(0.5);
  kalman.update({0.6, 0.0}, 11.0 / 12.0);

  const Motion<2>& motion = kalman.motion();
  EXPECT_NEAR(motion.point.x(), 0.6 * 25.0 / 36.0, 1e-12);
  EXPECT_NEAR(motion.velocity.x(), 0.6 * 0.75, 1e-12);
  EXPECT_NEAR(motion.pp, 25.0 / 12.0 * 11.0 / 36.0, 1e-12);
  EXPECT_NEAR(motion.pv, 9.0 / 4.0 * 11.0 / 36.0, 1e-12);
  EXPECT_NEAR(motion.vv, 5.0 - 0.75 * 9.0 / 4.0, 1e-12);
  EXPECT_EQ(motion.point.y(), 0.0);
}

/// A filter after 60 measurements, at 100 Hz, of a point with constant velocity along x.
IsotropicKalman<2> after_a_steady_second(const IsotropicKalmanSettings& settings, double speed) {
  IsotropicKalman<2> kalman(settings, {0.0, 0.0}, 1e-4);
  for (int k = 1; k <= 60; ++k) {
    kalman.predict(0.01);
    kalman.update({0.01 * speed * k, 0.0}, 1e-4);
  }
  return kalman;
}

TEST(IsotropicKalman, FollowsASharpTurnInOneStep) {
  const IsotropicKalmanSettings settings;
  IsotropicKalman<2> kalman = after_a_steady_second(settings, 200.0);

  // The point reverses at the start of the step: it moves by -2 u instead of 2 u, and the innovation is -4 u.
  kalman.predict(0.01);
  const Vector<2> before = kalman.motion().point;
  kalman.update(before - Vector<2>(4.0, 0.0), 1e-4);

  // The gains are 1 and 3/2 / dt, reduced by the variance of the measurement: 1e-4 in 8.
  EXPECT_NEAR(kalman.motion().point.x(), before.x() - 4.0, 1e-3);
  EXPECT_NEAR(kalman.motion().velocity.x(), 200.0 - 1.5 * 4.0 / 0.01, 1.0);
  // The time of the turn within the step is unknown: the velocity has a standard deviation of half the innovation or
  // more.
  EXPECT_GT(std::sqrt(kalman.motion().vv) * 0.01, 0.5 * 4.0);
}

TEST(IsotropicKalman, ReducesItsNoiseDuringSteadyMotion) {
  const IsotropicKalmanSettings settings;
  IsotropicKalman<2> kalman(settings, {0.0, 0.0}, 1e-4);
  kalman.predict(0.01);
  const double first = kalman.motion().pp;
  EXPECT_EQ(kalman.noise_scale(), 1.0);

  IsotropicKalman<2> later = after_a_steady_second(settings, 10.0);
  later.predict(0.01);

  EXPECT_LT(later.noise_scale(), 0.01);
  EXPECT_LT(later.motion().pp, 0.1 * first);
}

TEST(IsotropicKalman, IncreasesTheCovarianceOfAHiddenPoint) {
  IsotropicKalmanSettings settings;
  IsotropicKalman<3> kalman(settings, Vector<3>::Zero(), 1e-6);
  double before = 0.0;
  for (int k = 0; k < 20; ++k) {
    kalman.predict(0.01);
    kalman.coast();
    EXPECT_GT(kalman.motion().pp, before);
    before = kalman.motion().pp;
  }
  EXPECT_NEAR(kalman.since_seen_s(), 0.2, 1e-12);
}

TEST(InnovationCost, IsTheCostAtTheVarianceOfGreatestLikelihood) {
  for (const double distance2 : {0.0, 0.5, 1.9, 2.1, 30.0, 4000.0}) {
    const double variance = 1.0;
    double best = 1e300;
    for (double tried = variance; tried < 1e5; tried *= 1.0005) {
      best = std::min(best, distance2 / tried + 2.0 * std::log(tried));
    }
    EXPECT_NEAR(innovation_cost<2>(distance2, variance), best, 1e-6);
  }
}

}  // namespace isotropic_kalman_test
}  // namespace mocap::filter
