#pragma once

#include "base/archive.h"
#include "filter/point_filter.h"

namespace mocap::filter {

/// u is the unit of length: px in an image, m in the volume.
struct KalmanSettings {
  double acceleration_u_s2 = 10.0;      ///< standard deviation of the acceleration, each axis
  double acceleration_per_speed = 0.0;  ///< added to it for each u/s of speed: fast limbs accelerate more
  double initial_speed_u_s = 1.0;       ///< standard deviation of the velocity of a new track, each axis
  double gate_floor_u = 0.0;            ///< standard deviation added to the gate
  double gate_per_speed = 0.0;          ///< the same for each u of predicted motion in a step
  double max_noise_scale = 1.0;         ///< largest factor on the variance of the process noise; 1: no adaptation
  double coast_half_life_s = 0.0;       ///< half-life of the speed without measurements; 0: constant speed
  bool white_noise = false;             ///< the acceleration varies within a step; false: it is constant in a step

  void archive(Archive& members) {
    members(acceleration_u_s2, acceleration_per_speed, initial_speed_u_s, gate_floor_u, gate_per_speed, max_noise_scale,
            coast_half_life_s, white_noise);
  }
};

/// Kalman filter with constant velocity, driven by a random acceleration that is constant within a step:
///
///   x' = x + v dt,  v' = v;   Q = s^2 [dt^4/4  dt^3/2; dt^3/2  dt^2] for each axis
///
/// `white_noise` has dt^4/3 instead of dt^4/4. If the measurements are far more precise than the process noise,
/// constant acceleration makes the errors of position and velocity fully correlated: the correction of the velocity is
/// 2 / dt times that of the position, and the velocity oscillates after a jerk. With white noise the velocity keeps an
/// uncertainty of its own, and the oscillation decays.
///
/// The axes are coupled if the covariances of the measurements couple them: two cameras measure a marker less precisely
/// along their line of sight. The process noise increases with the speed and with the noise scale, the smoothed ratio
/// of squared innovations to their expectation.
///
/// Source: Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation (2001): the filter,
/// section 5.2.3; the model (discrete white noise acceleration), section 6.3.2, or continuous white noise
/// acceleration of intensity s^2 dt, section 6.2.2; adjustable process noise from the normalised innovation, section
/// 11.2.2.
template <int N>
class Kalman {
 public:
  Kalman(const KalmanSettings& settings, const Seen<N>& first);

  void predict(double dt_s);
  Gate<N> gate() const;
  /// The gate after predict(dt_s); does not change the state.
  Gate<N> gate_in(double dt_s) const;
  void update(const Seen<N>& seen);
  void coast();
  Belief<N> belief() const { return {point_, velocity_, pp_}; }

  const Matrix<N>& velocity_covariance() const { return vv_; }
  const Matrix<N>& cross_covariance() const { return pv_; }  ///< row: point, column: velocity

  /// Writes the belief, or takes it over from an object that was built with the same settings (see Archive).
  void archive(Archive& members) {
    members(settings_, point_, velocity_, pp_, pv_, vv_, speed_, noise_scale_, last_dt_s_);
  }

 private:
  double acceleration_variance() const;
  void apply_measurement(const Vector<N>& innovation, const Matrix<N>& weight);

  KalmanSettings settings_;
  Vector<N> point_;
  Vector<N> velocity_;
  Matrix<N> pp_, pv_, vv_;
  double speed_ = 0.0;
  double noise_scale_ = 1.0;
  double last_dt_s_ = 0.0;
};

template <>
void Kalman<2>::apply_measurement(const Vector<2>& innovation, const Matrix<2>& weight);
template <>
void Kalman<3>::apply_measurement(const Vector<3>& innovation, const Matrix<3>& weight);
extern template class Kalman<2>;
extern template class Kalman<3>;

}  // namespace mocap::filter
