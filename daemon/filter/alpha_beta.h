#pragma once

#include "filter/point_filter.h"

namespace mocap::filter {

/// u is the unit of length: px in an image, m in the volume.
struct AlphaBetaSettings {
  double alpha = 0.8;            ///< share of the innovation that moves the point, 0 to 1
  double beta = 0.5;             ///< share that changes the velocity, 0 to 2
  double gate_u = 10.0;          ///< standard deviation of the gate
  double gate_per_speed = 0.0;   ///< the same, for each u that the point is expected to move: an adaptive gate
  double gate_per_miss_u = 0.0;  ///< the same, for each step without a sighting
};

/// Constant velocity with fixed gains.
///
///   x' = x + v dt;   r = z - x';   x = x' + alpha r;   v' = v + beta r / dt
///
/// Source: Kalata, "The tracking index: a generalized parameter for alpha-beta and alpha-beta-gamma target trackers",
/// IEEE Trans. Aerospace and Electronic Systems 20 (1984), equations 1 to 4.
template <int N>
class AlphaBeta {
 public:
  AlphaBeta(const AlphaBetaSettings& settings, const Seen<N>& first);

  void predict(double dt_s);
  Gate<N> gate() const;
  void update(const Seen<N>& seen);
  void coast();
  /// Goes on from what others found out; the last step ended in a sighting.
  void restart(const Vector<N>& point, const Vector<N>& velocity);
  /// The filter knows no covariance of its own; its gate stands for it.
  Belief<N> belief() const { return {point_, velocity_, gate().covariance}; }

 private:
  AlphaBetaSettings settings_;
  Vector<N> point_;
  Vector<N> velocity_;
  double since_seen_s_ = 0.0;
  double last_dt_s_ = 0.0;
  double misses_ = 0.0;
};

extern template class AlphaBeta<2>;
extern template class AlphaBeta<3>;

}  // namespace mocap::filter
