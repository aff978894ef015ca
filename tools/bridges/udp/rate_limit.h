#pragma once

#include <chrono>

namespace mocap::bridge {

/// Selects the frames that a receiver gets: at most one in each period on average. Reads no clock.
class RateLimit {
 public:
  using Time = std::chrono::steady_clock::time_point;
  using Duration = std::chrono::steady_clock::duration;

  /// `rate_hz` is greater than 0.
  explicit RateLimit(double rate_hz)
      : period_(std::chrono::duration_cast<Duration>(std::chrono::duration<double>(1.0 / rate_hz))) {}

  /// Whether the frame of this time is sent. A frame may come a quarter of a period early, so that jitter does not
  /// halve the rate of a feed that has just this rate. Time that goes back, after a restart of the daemon, begins anew.
  bool admits(Time now) {
    if (due_ - now > 2 * period_) due_ = now;
    if (now < due_ - period_ / 4) return false;
    due_ = due_ + period_ > now ? due_ + period_ : now + period_ / 2;
    return true;
  }

 private:
  Duration period_;
  Time due_{};
};

}  // namespace mocap::bridge
