#pragma once

#include "base/time.h"

namespace mocap {

/// Selects the frames of a feed that a receiver gets: at most one in each period on average. Reads no clock.
class RateLimit {
 public:
  /// `rate_hz` is greater than 0.
  explicit RateLimit(double rate_hz) : period_(from_s(1.0 / rate_hz)) {}

  /// Whether the frame of this time is sent. A frame may come a quarter of a period early, so that jitter does not
  /// halve the rate of a feed that has just this rate. Time that goes back, after a restart of the daemon, begins anew.
  bool admits(Timestamp now) {
    if (due_ - now > 2 * period_) due_ = now;
    if (now < due_ - period_ / 4) return false;
    due_ = due_ + period_ > now ? due_ + period_ : now + period_ / 2;
    return true;
  }

 private:
  Duration period_;
  Timestamp due_{};
};

}  // namespace mocap
