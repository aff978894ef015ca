#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "filter/alpha_beta.h"
#include "filter/condensation.h"
#include "filter/kalman.h"
#include "filter/point_filter.h"

namespace mocap::filter {
namespace filters_test {

static_assert(PointFilter<Kalman<2>, 2> && PointFilter<Kalman<3>, 3>);
static_assert(PointFilter<AlphaBeta<2>, 2> && PointFilter<AlphaBeta<3>, 3>);
static_assert(PointFilter<Condensation<2>, 2> && PointFilter<Condensation<3>, 3>);

Seen<3> seen3(Random& random) {
  Matrix<3> root;
  for (int i = 0; i < 9; ++i) root(i) = random.normal();
  Vector<3> point;
  for (int i = 0; i < 3; ++i) point[i] = 5.0 * random.normal();
  return {point, root * root.transpose() + 0.1 * Matrix<3>::Identity()};
}

/// The estimate by weighted least squares over the whole history. The unknowns are the first position, the first
/// velocity and the acceleration in each step, each with its prior.
Belief<3> batch(const std::vector<Seen<3>>& sightings, double dt, const KalmanSettings& settings, Matrix<3>& cov) {
  const int steps = static_cast<int>(sightings.size()) - 1;
  const int unknowns = 6 + 3 * steps;
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(unknowns, unknowns);
  Eigen::VectorXd rhs = Eigen::VectorXd::Zero(unknowns);
  Eigen::MatrixXd state = Eigen::MatrixXd::Zero(6, unknowns);  // state at step k as a linear function of the unknowns
  state.topLeftCorner(6, 6).setIdentity();
  Eigen::MatrixXd transition = Eigen::MatrixXd::Identity(6, 6);
  transition.topRightCorner(3, 3) = dt * Matrix<3>::Identity();
  information.block(3, 3, 3, 3) += Matrix<3>::Identity() / std::pow(settings.initial_speed_u_s, 2);
  for (int k = 0; k <= steps; ++k) {
    if (k > 0) {
      state = (transition * state).eval();
      const int at = 6 + 3 * (k - 1);
      state.block(0, at, 3, 3) += 0.5 * dt * dt * Matrix<3>::Identity();
      state.block(3, at, 3, 3) += dt * Matrix<3>::Identity();
      information.block(at, at, 3, 3) += Matrix<3>::Identity() / std::pow(settings.acceleration_u_s2, 2);
    }
    const auto& [point, covariance] = sightings[static_cast<std::size_t>(k)];
    const Eigen::MatrixXd rows = state.topRows(3);
    information += rows.transpose() * covariance.inverse() * rows;
    rhs += rows.transpose() * covariance.inverse() * point;
  }
  const Eigen::VectorXd solution = information.ldlt().solve(rhs);
  const Eigen::VectorXd last = state * solution;
  const Eigen::MatrixXd last_cov = state * information.inverse() * state.transpose();
  cov = last_cov.block(3, 3, 3, 3);
  return {last.head<3>(), last.tail<3>(), last_cov.topLeftCorner(3, 3)};
}

TEST(Kalman, ComputesTheGateOfALaterTimeWithoutPredicting) {
  Random random(17);
  KalmanSettings settings;
  settings.acceleration_per_speed = 6.0;
  settings.gate_floor_u = 0.004;
  settings.gate_per_speed = 0.1;
  settings.white_noise = true;
  Kalman<3> filter(settings, seen3(random));
  for (int step = 0; step < 5; ++step) {
    filter.predict(0.02);
    filter.update(seen3(random));
  }

  const Gate<3> gate_later = filter.gate_in(0.03);
  filter.predict(0.03);

  // The tolerance is rounding.
  EXPECT_LT((gate_later.centre - filter.gate().centre).norm(), 1e-12);
  EXPECT_LT((gate_later.predicted_covariance - filter.gate().predicted_covariance).norm(),
            1e-12 * gate_later.predicted_covariance.norm());
  const Seen<3> seen = seen3(random);
  EXPECT_NEAR(gate_later.distance2(seen), gate_later.fit(seen).distance2, 1e-12 * gate_later.fit(seen).distance2);
}

TEST(Kalman, AgreesWithLeastSquaresOverTheWholeHistory) {
  Random random(4);
  const double dt = 0.1;
  KalmanSettings settings;
  settings.acceleration_u_s2 = 3.0;
  settings.initial_speed_u_s = 20.0;
  std::vector<Seen<3>> sightings{seen3(random)};
  Kalman<3> kalman(settings, sightings[0]);
  for (int k = 0; k < 12; ++k) {
    sightings.push_back(seen3(random));
    kalman.predict(dt);
    kalman.update(sightings.back());

    Matrix<3> velocity_covariance;
    const Belief<3> reference = batch(sightings, dt, settings, velocity_covariance);

    const Belief<3> belief = kalman.belief();
    EXPECT_LT((belief.point - reference.point).norm(), 1e-8);
    EXPECT_LT((belief.velocity - reference.velocity).norm(), 1e-7);
    EXPECT_LT((belief.covariance - reference.covariance).norm(), 1e-8);
    EXPECT_LT((kalman.velocity_covariance() - velocity_covariance).norm(), 1e-7);
  }
}

TEST(Kalman, ConvergesToTheGainsOfTheTrackingIndex) {
  // Kalata (1984): with index L = s_a dt^2 / s_z, r = (4 + L - sqrt(8 L + L^2)) / 4, alpha = 1 - r^2,
  // beta = 2 (2 - alpha) - 4 sqrt(1 - alpha).
  const double dt = 0.02;
  const double sigma = 0.7;
  for (const double index : {0.05, 0.3, 2.0}) {
    KalmanSettings settings;
    settings.acceleration_u_s2 = index * sigma / (dt * dt);
    settings.initial_speed_u_s = 100.0;
    const Seen<2> still{Vector<2>::Zero(), Matrix<2>::Identity() * sigma * sigma};
    Kalman<2> kalman(settings, still);
    for (int k = 0; k < 500; ++k) {
      kalman.predict(dt);
      kalman.update(still);
    }

    kalman.predict(dt);
    const Belief<2> before = kalman.belief();
    kalman.update({before.point + Vector<2>(1.0, 0.0), still.covariance});

    const double r = (4.0 + index - std::sqrt(8.0 * index + index * index)) / 4.0;
    const double alpha = 1.0 - r * r;
    const double beta = 2.0 * (2.0 - alpha) - 4.0 * std::sqrt(1.0 - alpha);
    EXPECT_NEAR(kalman.belief().point.x() - before.point.x(), alpha, 1e-9);
    EXPECT_NEAR((kalman.belief().velocity.x() - before.velocity.x()) * dt, beta, 1e-9);
  }
}

TEST(Kalman, WidensItsGateWithoutMeasurements) {
  KalmanSettings settings;
  Kalman<3> kalman(settings, {Vector<3>::Zero(), Matrix<3>::Identity() * 1e-6});
  double before = 0.0;
  for (int k = 0; k < 20; ++k) {
    kalman.predict(0.01);
    kalman.coast();
    const double now = kalman.gate().predicted_covariance.trace();
    EXPECT_GT(now, before);
    before = now;
  }
}

TEST(Kalman, FollowsATurnBetterIfItsNoiseAdapts) {
  KalmanSettings calm;
  calm.acceleration_u_s2 = 1.0;
  KalmanSettings adaptive = calm;
  adaptive.max_noise_scale = 100.0;
  const auto error_after_turn = [](const KalmanSettings& settings) {
    const Matrix<2> noise = Matrix<2>::Identity() * 1e-6;
    Kalman<2> kalman(settings, {Vector<2>::Zero(), noise});
    double error = 0.0;
    for (int k = 1; k <= 100; ++k) {
      const double t = 0.01 * k;
      const Vector<2> truth(t < 0.5 ? 2.0 * t : 2.0 - 2.0 * t, 0.0);
      kalman.predict(0.01);
      error += (kalman.belief().point - truth).norm();
      kalman.update({truth, noise});
    }
    return error;
  };

  EXPECT_LT(error_after_turn(adaptive), 0.7 * error_after_turn(calm));
}

TEST(AlphaBeta, HasNoErrorAtConstantVelocityAndTheKnownLagUnderAcceleration) {
  // The lag under a constant acceleration a is a dt^2 (1 - alpha) / beta after the update: Kalata (1984).
  AlphaBetaSettings settings;
  settings.alpha = 0.6;
  settings.beta = 0.3;
  const double dt = 0.05;
  for (const double acceleration : {0.0, 8.0}) {
    AlphaBeta<2> filter(settings, {Vector<2>(1.0, 0.0), Matrix<2>::Identity()});
    Vector<2> truth;
    for (int k = 1; k <= 400; ++k) {
      const double t = dt * k;
      truth = Vector<2>(1.0 + 3.0 * t + 0.5 * acceleration * t * t, -2.0 * t);
      filter.predict(dt);
      filter.update({truth, Matrix<2>::Identity()});
    }

    const double lag = acceleration * dt * dt * (1.0 - settings.alpha) / settings.beta;
    EXPECT_NEAR(truth.x() - filter.belief().point.x(), lag, 1e-9);
    EXPECT_NEAR(truth.y(), filter.belief().point.y(), 1e-9);
  }
}

TEST(AlphaBeta, WidensItsGateWithSpeedAndWithMisses) {
  AlphaBetaSettings settings;
  settings.alpha = 1.0;
  settings.beta = 1.0;
  settings.gate_u = 2.0;
  settings.gate_per_speed = 0.5;
  settings.gate_per_miss_u = 3.0;
  AlphaBeta<2> filter(settings, {Vector<2>::Zero(), Matrix<2>::Identity()});
  filter.predict(0.1);
  filter.update({Vector<2>(4.0, 0.0), Matrix<2>::Identity()});  // 40 u/s
  filter.predict(0.1);

  EXPECT_NEAR(std::sqrt(filter.gate().predicted_covariance(0, 0)), 2.0 + 0.5 * 4.0, 1e-12);
  filter.coast();
  filter.predict(0.1);
  EXPECT_NEAR(std::sqrt(filter.gate().predicted_covariance(0, 0)), 2.0 + 0.5 * 4.0 + 3.0, 1e-12);
  EXPECT_NEAR(filter.gate().centre.x(), 12.0, 1e-12);
}

TEST(Condensation, AgreesWithTheKalmanPosteriorOnAverage) {
  // The model is linear and Gaussian, so that the Kalman filter gives the exact posterior.
  KalmanSettings kalman_settings;
  kalman_settings.acceleration_u_s2 = 30.0;
  kalman_settings.initial_speed_u_s = 20.0;
  const double sigma = 1.0;
  const double dt = 0.1;
  const auto sighting = [&](int k) {
    return Seen<2>{Vector<2>(2.0 * k + std::sin(1.7 * k), std::cos(2.3 * k)), Matrix<2>::Identity() * sigma * sigma};
  };
  Kalman<2> kalman(kalman_settings, sighting(0));
  for (int k = 1; k <= 6; ++k) {
    kalman.predict(dt);
    kalman.update(sighting(k));
  }

  constexpr int kSeeds = 300;
  Vector<2> mean = Vector<2>::Zero();
  Vector<2> velocity = Vector<2>::Zero();
  Matrix<2> covariance = Matrix<2>::Zero();
  for (std::uint64_t seed = 0; seed < kSeeds; ++seed) {
    CondensationSettings settings;
    settings.particles = kMaxParticles;
    settings.acceleration_u_s2 = kalman_settings.acceleration_u_s2;
    settings.initial_speed_u_s = kalman_settings.initial_speed_u_s;
    settings.sighting_u = 0.0;
    settings.seed = 1000 + seed;
    Condensation<2> condensation(settings, sighting(0));
    for (int k = 1; k <= 6; ++k) {
      condensation.predict(dt);
      condensation.update(sighting(k));
    }
    mean += condensation.belief().point / kSeeds;
    velocity += condensation.belief().velocity / kSeeds;
    covariance += condensation.belief().covariance / kSeeds;
  }

  // The error of one run of 256 particles is about an eighth of the posterior standard deviation. The mean of 300 runs
  // has a smaller error and a bias of 1/256.
  EXPECT_LT((mean - kalman.belief().point).norm(), 0.03 * sigma);
  EXPECT_LT((velocity - kalman.belief().velocity).norm(), 0.4);
  EXPECT_LT((covariance - kalman.belief().covariance).norm(), 0.06 * kalman.belief().covariance.norm());
}

TEST(Condensation, SamplesAnewAroundAMeasurementFarFromAllParticles) {
  Condensation<2> condensation({}, {Vector<2>::Zero(), Matrix<2>::Identity() * 0.01});
  condensation.predict(0.01);
  const Vector<2> far(1e4, -1e4);

  condensation.update({far, Matrix<2>::Identity() * 0.01});

  EXPECT_LT((condensation.belief().point - far).norm(), 1.0);
  EXPECT_TRUE(condensation.belief().covariance.allFinite());
}

TEST(Condensation, GivesEqualResultsInEqualRuns) {
  const auto run = [] {
    Condensation<3> condensation({}, {Vector<3>::Zero(), Matrix<3>::Identity()});
    for (int k = 0; k < 20; ++k) {
      condensation.predict(0.01);
      condensation.update({Vector<3>(0.1 * k, 0.0, 1.0), Matrix<3>::Identity()});
    }
    return condensation.belief().point;
  };

  EXPECT_EQ(run(), run());
}

TEST(Gate, HasTheCostOfANormalDensity) {
  Matrix<2> covariance;
  covariance << 2.0, 0.3, 0.3, 1.0;
  const Gate<2> gate{Vector<2>(1.0, 2.0), covariance};
  const Seen<2> seen{Vector<2>(2.5, 1.0), Matrix<2>::Identity() * 0.5};

  const auto fit = gate.fit(seen);

  // Computed by hand: S = [2.5 .3; .3 1.5], det 3.66, off (1.5, -1): (1.5 * 2.25 + 2 * .3 * 1.5 + 2.5) / 3.66.
  EXPECT_NEAR(fit.distance2, (1.5 * 2.25 + 2.0 * 0.3 * 1.5 + 2.5) / 3.66, 1e-12);
  EXPECT_NEAR(fit.cost, fit.distance2 + std::log(3.66) + 2.0 * std::log(2.0 * M_PI), 1e-12);
}

}  // namespace filters_test
}  // namespace mocap::filter
