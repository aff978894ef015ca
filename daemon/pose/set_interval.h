#pragma once

#include <algorithm>

#include "base/archive.h"

namespace mocap::pose {

/// Usual interval between the sets of a tracker: a running mean over time, not over sets, so that two sets that follow
/// each other closely do not halve it.
///
/// A velocity that is filtered with a constant gain a set (an alpha-beta filter, Kalata 1984) is unstable when a set
/// follows its predecessor after a fraction of the usual interval: the error of both positions is divided by that
/// fraction. `gain_factor` reduces the gain in proportion, so that the error is divided by the usual interval.
///
/// Thread: one.
class SetInterval {
 public:
  /// Adds the interval before a set, s. An interval of 0 or less, or after a gap, is not to be added.
  void add(double step_s) {
    if (!(usual_s_ > 0.0)) usual_s_ = step_s;
    const double most_s = std::min(step_s, kMostGrowth * usual_s_);  // lost sets are seldom usual
    usual_s_ += kMemory * std::min(1.0, step_s / usual_s_) * (most_s - usual_s_);
  }
  void reset() { usual_s_ = 0.0; }

  /// 1 for a set after at least the usual interval, else the share of it.
  double gain_factor(double step_s) const { return usual_s_ > 0.0 ? std::clamp(step_s / usual_s_, 0.0, 1.0) : 1.0; }

  /// Writes the belief, or takes it over from an object that was built with the same settings (see Archive).
  void archive(Archive& members) { members(usual_s_); }

 private:
  // Chosen by hand; the result depends little on them, because the interval is nearly constant while the cameras are
  // synchronised.
  static constexpr double kMemory = 1.0 / 16.0;
  static constexpr double kMostGrowth = 2.0;

  double usual_s_ = 0.0;
};

}  // namespace mocap::pose
