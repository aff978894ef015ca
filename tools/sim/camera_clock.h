#pragma once

#include <atomic>
#include <cmath>
#include <cstdint>

namespace mocap::sim {

/// The clock of a simulated camera. It has an offset and a drift against UTC until PTP makes it follow UTC. Any thread.
class CameraClock {
 public:
  /// The clock is ahead of UTC by `skew_ns` at `began_utc_ns`. The offset grows by `drift` seconds per second.
  CameraClock(double skew_ns, double drift, std::int64_t began_utc_ns)
      : skew_ns_(skew_ns), drift_(drift), began_utc_ns_(began_utc_ns) {}

  /// The time that the clock shows at an instant of UTC.
  std::uint64_t stamp_ns(std::int64_t utc_ns) const {
    return static_cast<std::uint64_t>(utc_ns + std::llround(ahead_ns(utc_ns)));
  }

  /// The instant of UTC at which the clock shows `stamp_ns`.
  std::int64_t utc_ns(std::int64_t stamp_ns) const {
    const std::int64_t about = stamp_ns - std::llround(ahead_ns(stamp_ns));
    return stamp_ns - std::llround(ahead_ns(about));
  }

  /// PTP: from now on the clock is ahead of UTC by the constant `ahead_ns`.
  void follow_utc(std::int64_t ahead_ns) {
    followed_ahead_ns_ = ahead_ns;
    follows_ = true;
  }
  /// Returns to the clock's own offset and drift.
  void run_free() { follows_ = false; }
  bool follows_utc() const { return follows_; }

 private:
  double ahead_ns(std::int64_t utc_ns) const {
    if (follows_) return static_cast<double>(followed_ahead_ns_);
    return skew_ns_ + drift_ * static_cast<double>(utc_ns - began_utc_ns_);
  }

  double skew_ns_;
  double drift_;
  std::int64_t began_utc_ns_;
  std::atomic<std::int64_t> followed_ahead_ns_{0};
  std::atomic<bool> follows_{false};
};

}  // namespace mocap::sim
