#include "filter/kalman.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "filter/symmetric.h"

namespace mocap::filter {
namespace {

// How much the last innovation counts in the agility: about three steps are remembered.
constexpr double kAgilityRate = 0.3;

}  // namespace

template <int N>
Kalman<N>::Kalman(const KalmanSettings& settings, const Seen<N>& first)
    : settings_(settings),
      point_(first.point),
      velocity_(Vector<N>::Zero()),
      pp_(first.covariance),
      pv_(Matrix<N>::Zero()),
      vv_(Matrix<N>::Identity() * settings.birth_speed_u_s * settings.birth_speed_u_s) {}

// Variance of the acceleration.
template <int N>
double Kalman<N>::noise() const {
  const double sigma = settings_.acceleration_u_s2 + settings_.acceleration_per_speed * velocity_.norm();
  return sigma * sigma * agility_;
}

template <int N>
void Kalman<N>::predict(double dt_s) {
  const double added = noise();
  const double dt2 = dt_s * dt_s;
  point_ += velocity_ * dt_s;
  pp_ += dt_s * (pv_ + pv_.transpose()) + dt2 * vv_;
  pv_ += dt_s * vv_;
  pp_.diagonal().array() += added * dt2 * dt2 / (settings_.white_noise ? 3.0 : 4.0);
  pv_.diagonal().array() += added * dt2 * dt_s / 2.0;
  vv_.diagonal().array() += added * dt2;
  last_dt_s_ = dt_s;
}

template <int N>
Gate<N> Kalman<N>::gate() const {
  const double wider = settings_.gate_floor_u + settings_.gate_per_speed * velocity_.norm() * last_dt_s_;
  Gate<N> gate{point_, pp_};
  gate.covariance.diagonal().array() += wider * wider;
  return gate;
}

template <int N>
Gate<N> Kalman<N>::gate_in(double dt_s) const {
  const double dt2 = dt_s * dt_s;
  const double wider = settings_.gate_floor_u + settings_.gate_per_speed * velocity_.norm() * dt_s;
  Gate<N> gate{point_ + velocity_ * dt_s, pp_ + (dt_s * (pv_ + pv_.transpose()) + dt2 * vv_)};
  gate.covariance.diagonal().array() += noise() * dt2 * dt2 / (settings_.white_noise ? 3.0 : 4.0);
  gate.covariance.diagonal().array() += wider * wider;
  return gate;
}

template <int N>
void Kalman<N>::update(const Seen<N>& seen) {
  const Matrix<N> weight = inverse_of<N>(pp_ + seen.covariance);
  const Vector<N> innovation = seen.point - point_;
  const Matrix<N> gain_point = pp_ * weight;
  const Matrix<N> gain_velocity = pv_.transpose() * weight;
  point_ += gain_point * innovation;
  velocity_ += gain_velocity * innovation;
  // One half of what is symmetric, so that rounding does not make it lopsided.
  for (int row = 0; row < N; ++row) {
    for (int column = 0; column <= row; ++column) {
      vv_(row, column) -= gain_velocity.row(row).dot(pv_.col(column));
      vv_(column, row) = vv_(row, column);
    }
  }
  pv_ -= (gain_point * pv_).eval();
  const Matrix<N> before = pp_;
  for (int row = 0; row < N; ++row) {
    for (int column = 0; column <= row; ++column) {
      pp_(row, column) -= gain_point.row(row).dot(before.col(column));
      pp_(column, row) = pp_(row, column);
    }
  }
  const double surprise = innovation.dot(weight * innovation) / N;
  agility_ += kAgilityRate * (surprise - agility_);
  agility_ = std::clamp(agility_, 1.0, std::max(1.0, settings_.max_agility));
}

template <int N>
void Kalman<N>::coast() {
  if (settings_.coast_half_life_s <= 0.0) return;
  velocity_ *= std::exp2(-last_dt_s_ / settings_.coast_half_life_s);
}

template class Kalman<2>;
template class Kalman<3>;

}  // namespace mocap::filter
