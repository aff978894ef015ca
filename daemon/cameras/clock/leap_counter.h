#pragma once

#include <atomic>
#include <cstdint>

#include "module/stream_counters.h"

namespace mocap::cameras {

/// Adds the jumps of a camera's clock to the camera's counters. The camera's thread makes all calls.
class LeapCounter {
 public:
  /// `leaps`: number of jumps so far, as ClockMapping and ExposureClock count them.
  void count(std::uint64_t leaps, StreamCounters& counters) noexcept {
    if (leaps > counted_) counters.clock_leaps.fetch_add(leaps - counted_, std::memory_order_relaxed);
    counted_ = leaps;
  }

  /// The same for jumps that do not count, because the times of the images do not depend on this clock.
  void skip(std::uint64_t leaps) noexcept { counted_ = leaps; }

 private:
  std::uint64_t counted_ = 0;
};

}  // namespace mocap::cameras
