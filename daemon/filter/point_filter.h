#pragma once

#include <Eigen/Core>
#include <concepts>

#include "base/archive.h"

namespace mocap::filter {

// A filter estimates the motion of one point in N (2 or 3) dimensions. The unit of length is the caller's (px in an
// image, m in the volume) and is `u` in names; time is in s.

template <int N>
using Vector = Eigen::Matrix<double, N, 1>;
template <int N>
using Matrix = Eigen::Matrix<double, N, N>;

/// A measurement of the point.
template <int N>
struct Seen {
  Vector<N> point;
  Matrix<N> covariance;

  void archive(Archive& members) { members(point, covariance); }
};

/// The estimated state of a point.
template <int N>
struct Belief {
  Vector<N> point;
  Vector<N> velocity;    ///< u/s
  Matrix<N> covariance;  ///< of the point

  void archive(Archive& members) { members(point, velocity, covariance); }
};

/// The region in which the next measurement is expected.
template <int N>
struct Gate {
  Vector<N> centre;
  Matrix<N> predicted_covariance;  ///< of the predicted position, widened; `fit` adds that of the measurement

  /// Half the size, along each axis, of a box that contains all measurements within `sigmas` standard deviations. No
  /// measurement has a larger variance than `max_variance` along an axis.
  Vector<N> reach(double sigmas, double max_variance) const;

  struct Fit {
    double distance2;  ///< squared Mahalanobis distance
    double cost;       ///< -2 ln of the likelihood density, u^-N
  };

  /// Distance and likelihood of a measurement. Costs of different gates are comparable: a wide gate has a lower density
  /// than a narrow one.
  Fit fit(const Seen<N>& seen) const;
  /// The squared Mahalanobis distance only.
  double distance2(const Seen<N>& seen) const;

  void archive(Archive& members) { members(centre, predicted_covariance); }
};

/// A motion filter of one point. In each step: predict, then gate, then update or coast.
template <class F, int N>
concept PointFilter = std::copyable<F> && requires(F filter, const F& known, const Seen<N>& seen, double dt_s) {
  /// Predicts the state `dt_s` (0 or more) later.
  filter.predict(dt_s);
  /// The region of the measurement at the predicted time.
  { known.gate() } -> std::same_as<Gate<N>>;
  /// Updates the state with a measurement.
  filter.update(seen);
  /// Notes that the predicted state has no measurement.
  filter.coast();
  { known.belief() } -> std::same_as<Belief<N>>;
};

extern template struct Gate<2>;
extern template struct Gate<3>;

}  // namespace mocap::filter
