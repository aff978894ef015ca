#pragma once

#include "base/archive.h"
#include "filter/point_filter.h"

namespace mocap::filter {

/// u is the unit of length: px in an image, m in the volume.
struct AlphaBetaSettings {
  double alpha = 0.8;            ///< gain of the position, 0 to 1
  double beta = 0.5;             ///< gain of the velocity, 0 to 2
  double gate_u = 10.0;          ///< standard deviation of the gate
  double gate_per_speed = 0.0;   ///< added to it for each u of predicted motion in a step: an adaptive gate
  double gate_per_miss_u = 0.0;  ///< added to it for each step without a measurement
};

/// Filter with constant velocity and fixed gains (alpha-beta filter).
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
  /// Continues from this state, as after a measurement.
  void restart(const Vector<N>& point, const Vector<N>& velocity);
  /// The covariance is that of the gate: the filter has no covariance of its state.
  Belief<N> belief() const { return {point_, velocity_, gate().predicted_covariance}; }

  /// Writes the belief, or takes it over from an object that was built with the same settings (see Archive).
  void archive(Archive& members) { members(point_, velocity_, since_seen_s_, last_dt_s_, misses_); }

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
