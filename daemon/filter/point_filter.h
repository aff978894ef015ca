#pragma once

#include <Eigen/Core>
#include <concepts>

namespace mocap::filter {

// A filter follows one point in N dimensions. The unit of length is the caller's (px in an image, m in the volume),
// written `u` in names; time is in s. N is 2 or 3.

template <int N>
using Vector = Eigen::Matrix<double, N, 1>;
template <int N>
using Matrix = Eigen::Matrix<double, N, N>;

/// Where the point was seen, and how well.
template <int N>
struct Seen {
  Vector<N> point;
  Matrix<N> covariance;
};

/// What a filter holds for true.
template <int N>
struct Belief {
  Vector<N> point;
  Vector<N> velocity;    ///< u/s
  Matrix<N> covariance;  ///< of the point
};

/// Where the next sighting is looked for.
template <int N>
struct Gate {
  Vector<N> centre;
  Matrix<N> covariance;  ///< the sighting's own comes on top

  /// Half the size along each axis of a box that holds all sightings within `sigmas`, where none is less certain than
  /// `max_variance` along an axis.
  Vector<N> reach(double sigmas, double max_variance) const;

  struct Fit {
    double distance2;  ///< squared, in standard deviations (Mahalanobis)
    double cost;       ///< -2 ln of the likelihood density, u^-N
  };

  /// How well a sighting fits; the cost allows to compare the fit of sightings to several gates: a wide gate makes
  /// every sighting in it less likely than the narrow gate of a point that is well known.
  Fit fit(const Seen<N>& seen) const;
  /// The same distance without the cost.
  double distance2(const Seen<N>& seen) const;
};

/// What every filter does. A set of sightings at one time: predict, then gate, then update or coast.
template <class F, int N>
concept PointFilter = std::copyable<F> && requires(F filter, const F& known, const Seen<N>& seen, double dt_s) {
  /// Moves the belief on by `dt_s` (0 or more).
  filter.predict(dt_s);
  /// Where the sighting should be now.
  { known.gate() } -> std::same_as<Gate<N>>;
  /// Takes in the sighting.
  filter.update(seen);
  /// Takes in that nothing was seen at the end of the last `predict`.
  filter.coast();
  { known.belief() } -> std::same_as<Belief<N>>;
};

extern template struct Gate<2>;
extern template struct Gate<3>;

}  // namespace mocap::filter
