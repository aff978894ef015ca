#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "filter/point_filter.h"

namespace mocap::filter {

/// u is the unit of length: px in an image, m in the volume.
struct IsotropicKalmanSettings {
  double acceleration_u_s2 = 10.0;  ///< standard deviation of what changes the motion, each axis, before any is seen
  double least_agility = 1e-3;      ///< share of its square that is left while the motion holds steady, 0 to 1
  double hidden_agility = 5e-3;     ///< share of its square that is reckoned with at least while nothing is seen
  double max_agility = 4.0;         ///< how many times its square is remembered after sightings surprised
  double birth_speed_u_s = 1.0;     ///< standard deviation of a new point's velocity, each axis
};

/// What a filter holds for true of a point whose axes are known equally well: three numbers are its covariance.
template <int N>
struct Motion {
  Vector<N> point = Vector<N>::Zero();
  Vector<N> velocity = Vector<N>::Zero();  ///< u/s
  double pp = 0.0;                         ///< variance of the point, each axis
  double pv = 0.0;                         ///< covariance of point and velocity, each axis
  double vv = 0.0;                         ///< variance of the velocity, each axis
};

/// -2 ln of the likelihood of an innovation whose square is `distance2`, where its variance on each of `N` axes is
/// `variance` or more: the greatest likelihood over what the variance may be, less N ln(2 pi).
///
///   d2 / s + N ln s  where d2 <= N s, else  N + N ln(d2 / N)
///
/// Its tail is a logarithm: one sharp turn is likelier than two half ones, as it is with markers.
template <int N>
inline double innovation_cost(double distance2, double variance) {
  const double needed = distance2 / N;
  return needed <= variance ? distance2 / variance + N * std::log(variance) : N + N * std::log(needed);
}

/// Constant velocity, driven by a change of velocity w at some time in each step, any time as likely; all axes share
/// one covariance, which is exact where sightings are as certain on each axis as on the others.
///
///   x' = x + v dt,  v' = v;   Q = W [dt^2/3  dt/2; dt/2  1] for each axis,  W = agility (a dt)^2
///
/// The process noise follows the innovation r twice. Before a sighting is taken in, where r^2 / N is more than was
/// expected, W is made as large as makes it expected: a sharp turn is followed at once (gains near 1 and 3/2 / dt). And
/// agility, the smoothed W over its first guess, is remembered: steady motion makes the filter sharp, down to
/// `least_agility`, or `hidden_agility` while the point is not seen.
///
/// Source: Bar-Shalom, Li, Kirubarajan, Estimation with Applications to Tracking and Navigation (2001): the filter,
/// equations 5.2.3-11 to 5.2.3-17; the noise, equation 6.2.2-12; process noise from the innovation, section 11.2.2.
template <int N>
class IsotropicKalman {
 public:
  /// `settings` are borrowed and outlive the filter.
  IsotropicKalman(const IsotropicKalmanSettings& settings, const Vector<N>& point, double variance)
      : settings_(&settings) {
    motion_.point = point;
    motion_.pp = variance;
    motion_.vv = settings.birth_speed_u_s * settings.birth_speed_u_s;
  }

  IsotropicKalman(IsotropicKalmanSettings&& settings, const Vector<N>& point, double variance) = delete;

  /// Moves on by `dt_s` (0 or more).
  void predict(double dt_s) {
    const double change = settings_->acceleration_u_s2 * dt_s;
    added_ = change * change * agility_;
    since_seen_s_ += dt_s;
    dt_s_ = dt_s;
    motion_.point += motion_.velocity * dt_s;
    motion_.pp += dt_s * (2.0 * motion_.pv + dt_s * (motion_.vv + added_ / 3.0));
    motion_.pv += dt_s * (motion_.vv + added_ / 2.0);
    motion_.vv += added_;
  }

  /// Takes in a sighting of that variance on each axis.
  void update(const Vector<N>& seen, double variance) {
    const Vector<N> innovation = seen - motion_.point;
    const double needed = innovation.squaredNorm() / N;
    learn(needed - (motion_.pp + variance));
    const double missing = needed - (motion_.pp + variance);
    if (missing > 0.0 && since_seen_s_ > 0.0) {
      // The motion changed at some time since it was last seen.
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

  /// Takes in that nothing was seen at the end of the last `predict`.
  void coast() { agility_ = std::max(agility_, settings_->hidden_agility); }

  /// Reckons with changes of that agility at least; steadiness is learned anew.
  void expect_changes(double agility) { agility_ = std::max(agility_, agility); }

  const Motion<N>& motion() const { return motion_; }
  double agility() const { return agility_; }
  double since_seen_s() const { return since_seen_s_; }

  /// Goes on from what others found out.
  void restart(const Motion<N>& motion) { motion_ = motion; }

 private:
  // About eight sightings are remembered.
  static constexpr double kMemory = 0.12;

  /// `more`: by how much the innovation's variance was above what was expected.
  void learn(double more) {
    const double change = settings_->acceleration_u_s2 * dt_s_;
    if (!(change > 0.0) || since_seen_s_ > dt_s_) return;
    const double found = (added_ + 3.0 * more / (dt_s_ * dt_s_)) / (change * change);
    agility_ += kMemory * (std::clamp(found, 0.0, settings_->max_agility) - agility_);
    agility_ = std::max(agility_, settings_->least_agility);
  }

  const IsotropicKalmanSettings* settings_;
  Motion<N> motion_;
  double agility_ = 1.0;
  double added_ = 0.0;  // to the velocity's variance, by the last step
  double dt_s_ = 0.0;
  double since_seen_s_ = 0.0;
};

}  // namespace mocap::filter
