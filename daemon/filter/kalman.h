#pragma once

#include "filter/point_filter.h"

namespace mocap::filter {

/// u is the unit of length: px in an image, m in the volume.
struct KalmanSettings {
  double acceleration_u_s2 = 10.0;      ///< standard deviation of what changes the motion, each axis
  double acceleration_per_speed = 0.0;  ///< u/s^2 for each u/s of speed, on top: what is fast turns hard
  double birth_speed_u_s = 1.0;         ///< standard deviation of a new point's velocity, each axis
  double gate_floor_u = 0.0;            ///< standard deviation that the gate has beyond the filter's own
  double gate_per_speed = 0.0;          ///< the same, for each u that the point is expected to move
  double max_agility = 1.0;             ///< how many times the noise may grow while sightings surprise; 1: never
  double coast_half_life_s = 0.0;       ///< an unseen point's speed halves in this time; 0: it goes on
  bool white_noise = false;             ///< within a step the acceleration changes too; false: it is constant there
};

/// Constant velocity, driven by a random acceleration that is constant over a step.
///
///   x' = x + v dt,  v' = v;   Q = s^2 [dt^4/4  dt^3/2; dt^3/2  dt^2] for each axis
///
/// `white_noise` has dt^4/3 in place of dt^4/4. Where sightings are far better than the noise, the constant
/// acceleration makes of place and velocity one and the same unknown: the velocity takes up twice what the place was
/// off, and after a jerk it rings from set to set. White noise leaves it in doubt, and it settles.
///
/// Axes are coupled where the sightings' covariances couple them: a marker that two cameras see is known less well
/// along their line of sight. Process noise follows the motion: with the speed, and with agility, the smoothed ratio of
/// squared innovations to what the filter expected of them.
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
  /// What `gate` would be after `predict(dt_s)`; the belief stays.
  Gate<N> gate_in(double dt_s) const;
  void update(const Seen<N>& seen);
  void coast();
  Belief<N> belief() const { return {point_, velocity_, pp_}; }

  const Matrix<N>& velocity_covariance() const { return vv_; }
  const Matrix<N>& cross_covariance() const { return pv_; }  ///< row: point, column: velocity

 private:
  double noise() const;
  void take_in(const Vector<N>& innovation, const Matrix<N>& weight);

  KalmanSettings settings_;
  Vector<N> point_;
  Vector<N> velocity_;
  Matrix<N> pp_, pv_, vv_;
  double speed_ = 0.0;
  double agility_ = 1.0;
  double last_dt_s_ = 0.0;
};

template <>
void Kalman<2>::take_in(const Vector<2>& innovation, const Matrix<2>& weight);
template <>
void Kalman<3>::take_in(const Vector<3>& innovation, const Matrix<3>& weight);
extern template class Kalman<2>;
extern template class Kalman<3>;

}  // namespace mocap::filter
