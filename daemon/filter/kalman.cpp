#include "filter/kalman.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "filter/symmetric.h"

namespace mocap::filter {
namespace {

// Weight of the last innovation in the noise scale: an average over about three steps.
constexpr double kNoiseScaleRate = 0.3;

// A column of three numbers, of which the first two share one 128-bit register. A product of two matrices then takes
// about half the instructions of scalar code.
struct Column {
  using Pair = double __attribute__((vector_size(16)));

  Pair xy;
  double z;

  static Column at(const double* from) {
    Column column;
    std::memcpy(&column.xy, from, sizeof column.xy);
    column.z = from[2];
    return column;
  }
  Column operator*(double by) const { return {xy * by, z * by}; }
  Column operator+(const Column& other) const { return {xy + other.xy, z + other.z}; }
  Column operator-(const Column& other) const { return {xy - other.xy, z - other.z}; }
  void put(double* to) const {
    std::memcpy(to, &xy, sizeof xy);
    to[2] = z;
  }
};
using Columns = std::array<Column, 3>;

Columns columns_of(const Matrix<3>& m) {
  return {Column::at(m.data()), Column::at(m.data() + 3), Column::at(m.data() + 6)};
}

Columns rows_of(const Matrix<3>& m) {
  const double* at = m.data();
  return {Column{{at[0], at[3]}, at[6]}, Column{{at[1], at[4]}, at[7]}, Column{{at[2], at[5]}, at[8]}};
}

// Product with a vector.
[[gnu::always_inline]] inline Column product(const Columns& a, const double* b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

Columns product(const Columns& a, const Matrix<3>& b) {
  return {product(a, b.data()), product(a, b.data() + 3), product(a, b.data() + 6)};
}

// Subtracts a symmetric matrix. Only one triangle is computed, so that rounding cannot make the result asymmetric.
void subtract_symmetric(const Columns& less, Matrix<3>& from) {
  const Column x = Column::at(from.data()) - less[0], y = Column::at(from.data() + 3) - less[1];
  const double zz = from(2, 2) - less[2].z;
  from << x.xy[0], x.xy[1], x.z, x.xy[1], y.xy[1], y.z, x.z, y.z, zz;
}

}  // namespace

template <int N>
Kalman<N>::Kalman(const KalmanSettings& settings, const Seen<N>& first)
    : settings_(settings),
      point_(first.point),
      velocity_(Vector<N>::Zero()),
      pp_(first.covariance),
      pv_(Matrix<N>::Zero()),
      vv_(Matrix<N>::Identity() * settings.initial_speed_u_s * settings.initial_speed_u_s) {}

// Variance of the acceleration, each axis.
template <int N>
double Kalman<N>::acceleration_variance() const {
  const double sigma = settings_.acceleration_u_s2 + settings_.acceleration_per_speed * speed_;
  return sigma * sigma * noise_scale_;
}

template <int N>
void Kalman<N>::predict(double dt_s) {
  const double added = acceleration_variance();
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
  const double wider = settings_.gate_floor_u + settings_.gate_per_speed * speed_ * last_dt_s_;
  Gate<N> gate{point_, pp_};
  gate.predicted_covariance.diagonal().array() += wider * wider;
  return gate;
}

template <int N>
Gate<N> Kalman<N>::gate_in(double dt_s) const {
  const double dt2 = dt_s * dt_s;
  const double wider = settings_.gate_floor_u + settings_.gate_per_speed * speed_ * dt_s;
  Gate<N> gate{point_ + velocity_ * dt_s, pp_ + (dt_s * (pv_ + pv_.transpose()) + dt2 * vv_)};
  gate.predicted_covariance.diagonal().array() +=
      acceleration_variance() * dt2 * dt2 / (settings_.white_noise ? 3.0 : 4.0);
  gate.predicted_covariance.diagonal().array() += wider * wider;
  return gate;
}

template <int N>
void Kalman<N>::update(const Seen<N>& seen) {
  const Matrix<N> weight = inverse_of<N>(pp_ + seen.covariance);
  const Vector<N> innovation = seen.point - point_;
  apply_measurement(innovation, weight);
  speed_ = velocity_.norm();
  const double normalised_innovation2 = innovation.dot(weight * innovation) / N;
  noise_scale_ += kNoiseScaleRate * (normalised_innovation2 - noise_scale_);
  noise_scale_ = std::clamp(noise_scale_, 1.0, std::max(1.0, settings_.max_noise_scale));
}

template <>
void Kalman<3>::apply_measurement(const Vector<3>& innovation, const Matrix<3>& weight) {
  const Columns gain_point = product(columns_of(pp_), weight);
  const Columns gain_velocity = product(rows_of(pv_), weight);
  (Column::at(point_.data()) + product(gain_point, innovation.data())).put(point_.data());
  (Column::at(velocity_.data()) + product(gain_velocity, innovation.data())).put(velocity_.data());
  subtract_symmetric(product(gain_velocity, pv_), vv_);
  const Columns pv_less = product(gain_point, pv_);
  for (std::size_t i = 0; i < 3; ++i) {
    double* const column = pv_.data() + 3 * i;
    (Column::at(column) - pv_less[i]).put(column);
  }
  subtract_symmetric(product(gain_point, pp_), pp_);
}

template <>
void Kalman<2>::apply_measurement(const Vector<2>& innovation, const Matrix<2>& weight) {
  const Matrix<2> gain_point = pp_ * weight;
  const Matrix<2> gain_velocity = pv_.transpose() * weight;
  point_ += gain_point * innovation;
  velocity_ += gain_velocity * innovation;
  const Matrix<2> vv_less = gain_velocity * pv_, pp_less = gain_point * pp_;
  pv_ -= (gain_point * pv_).eval();
  // Only one triangle is used, so that rounding cannot make the result asymmetric.
  vv_ -= vv_less.selfadjointView<Eigen::Lower>().toDenseMatrix();
  pp_ -= pp_less.selfadjointView<Eigen::Lower>().toDenseMatrix();
}

template <int N>
void Kalman<N>::coast() {
  if (settings_.coast_half_life_s <= 0.0) return;
  velocity_ *= std::exp2(-last_dt_s_ / settings_.coast_half_life_s);
  speed_ = velocity_.norm();
}

template class Kalman<2>;
template class Kalman<3>;

}  // namespace mocap::filter
