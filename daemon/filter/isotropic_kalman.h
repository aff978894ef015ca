#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/archive.h"
#include "filter/point_filter.h"

namespace mocap::filter {

/// u is the unit of length: px in an image, m in the volume.
struct IsotropicKalmanSettings {
  double acceleration_u_s2 = 10.0;   ///< initial standard deviation of the acceleration, each axis
  double least_noise_scale = 1e-3;   ///< smallest noise scale (factor on its square), after steady motion, 0 to 1
  double hidden_noise_scale = 5e-3;  ///< smallest noise scale while there is no measurement
  double max_noise_scale = 4.0;      ///< largest noise scale, after large innovations
  double initial_speed_u_s = 1.0;    ///< standard deviation of the velocity of a new track, each axis
};

/// State of a point with the same covariance on each axis, so that three numbers are the covariance.
template <int N>
struct Motion {
  Vector<N> point = Vector<N>::Zero();
  Vector<N> velocity = Vector<N>::Zero();  ///< u/s
  double pp = 0.0;                         ///< variance of the point, each axis
  double pv = 0.0;                         ///< covariance of point and velocity, each axis
  double vv = 0.0;                         ///< variance of the velocity, each axis

  void archive(Archive& members) { members(point, velocity, pp, pv, vv); }
};

/// -2 ln of the likelihood of an innovation with the squared length `distance2`, without the constant N ln(2 pi). The
/// variance on each of N axes is the one of greatest likelihood that is at least `variance`:
///
///   d2 / s + N ln s  if d2 <= N s, else  N + N ln(d2 / N)
///
/// For large innovations the cost grows with their logarithm: one large innovation costs less than two of half the
/// size. Markers turn sharply in one step rather than in two.
template <int N>
inline double innovation_cost(double distance2, double variance) {
  const double needed = distance2 / N;
  return needed <= variance ? distance2 / variance + N * std::log(variance) : N + N * std::log(needed);
}

/// Kalman filter with constant velocity and white-noise acceleration: in each step the velocity changes at a uniformly
/// distributed time. All axes share one covariance, which is exact if the measurement noise is isotropic.
///
///   x' = x + v dt,  v' = v;   Q = W [dt^2/3  dt/2; dt/2  1] for each axis,  W = scale (a dt)^2
///
/// The process noise adapts to the innovation r in two ways. Before an update, if r^2 / N is larger than its
/// expectation, W is increased until both are equal: the filter follows a sharp turn in one step (gains near 1 and
/// 3/2 / dt). Between updates, the noise scale is the smoothed ratio of W to its initial value: steady motion reduces
/// the noise, down to `least_noise_scale`, or `hidden_noise_scale` without measurements.
///
/// Source: Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation (2001): the filter,
/// equations 5.2.3-11 to 5.2.3-17; the noise, equation 6.2.2-12; process noise from the innovation, section 11.2.2.
template <int N>
class IsotropicKalman {
 public:
  /// The settings outlive the filter. `variance`: of the position, each axis.
  IsotropicKalman(const IsotropicKalmanSettings& settings, const Vector<N>& point, double variance)
      : settings_(&settings) {
    motion_.point = point;
    motion_.pp = variance;
    motion_.vv = settings.initial_speed_u_s * settings.initial_speed_u_s;
  }

  IsotropicKalman(IsotropicKalmanSettings&& settings, const Vector<N>& point, double variance) = delete;

  /// Predicts the state `dt_s` (0 or more) later.
  void predict(double dt_s) {
    const double change = settings_->acceleration_u_s2 * dt_s;
    added_ = change * change * noise_scale_;
    since_seen_s_ += dt_s;
    dt_s_ = dt_s;
    motion_.point += motion_.velocity * dt_s;
    motion_.pp += dt_s * (2.0 * motion_.pv + dt_s * (motion_.vv + added_ / 3.0));
    motion_.pv += dt_s * (motion_.vv + added_ / 2.0);
    motion_.vv += added_;
  }

  /// Updates the state with a measurement of this variance on each axis.
  void update(const Vector<N>& seen, double variance) {
    const Vector<N> innovation = seen - motion_.point;
    const double needed = innovation.squaredNorm() / N;
    update_noise_scale(needed - (motion_.pp + variance));
    const double missing = needed - (motion_.pp + variance);
    if (missing > 0.0 && since_seen_s_ > 0.0) {
      // The velocity changed at an unknown time since the last measurement.
      const double change = 3.0 * missing / (since_seen_s_ * since_seen_s_);
      motion_.pp += missing;
      motion_.pv += change * since_seen_s_ / 2.0;
      motion_.vv += change;
    }
    const double total = motion_.pp + variance;
    const double point_gain = motion_.pp / total;
    const double velocity_gain = motion_.pv / total;
    motion_.point += point_gain * innovation;
    motion_.velocity += velocity_gain * innovation;
    motion_.vv -= velocity_gain * motion_.pv;
    motion_.pv *= 1.0 - point_gain;
    motion_.pp *= 1.0 - point_gain;
    since_seen_s_ = 0.0;
  }

  /// Notes that the last predicted state has no measurement.
  void coast() { noise_scale_ = std::max(noise_scale_, settings_->hidden_noise_scale); }

  /// Raises the noise scale to at least this value.
  void expect_changes(double noise_scale) { noise_scale_ = std::max(noise_scale_, noise_scale); }

  const Motion<N>& motion() const { return motion_; }
  double noise_scale() const { return noise_scale_; }
  double since_seen_s() const { return since_seen_s_; }

  /// Replaces the state; the noise scale stays.
  void restart(const Motion<N>& motion) { motion_ = motion; }

  /// Writes the belief, or takes it over from an object that was built with the same settings (see Archive).
  void archive(Archive& members) { members(motion_, noise_scale_, added_, dt_s_, since_seen_s_); }

 private:
  // Weight of the newest measurement in the noise scale: an average over about eight measurements.
  static constexpr double kMemory = 0.12;

  // Updates the noise scale. `excess`: squared innovation for each axis minus its expectation.
  void update_noise_scale(double excess) {
    const double change = settings_->acceleration_u_s2 * dt_s_;
    if (!(change > 0.0) || since_seen_s_ > dt_s_) return;
    const double found = (added_ + 3.0 * excess / (dt_s_ * dt_s_)) / (change * change);
    noise_scale_ += kMemory * (std::clamp(found, 0.0, settings_->max_noise_scale) - noise_scale_);
    noise_scale_ = std::max(noise_scale_, settings_->least_noise_scale);
  }

  const IsotropicKalmanSettings* settings_;
  Motion<N> motion_;
  double noise_scale_ = 1.0;
  double added_ = 0.0;  // process noise that the last step added to the variance of the velocity
  double dt_s_ = 0.0;
  double since_seen_s_ = 0.0;
};

}  // namespace mocap::filter
