#pragma once

#include <chrono>
#include <thread>

#include "base/time.h"

namespace mocap::bench {

/// Sleeps until shortly before `at`, then polls, so that the latency of the timer is not measured.
inline void wait_until(Timestamp at) {
  const Duration early = std::chrono::microseconds(300);
  if (at - host_now() > early) std::this_thread::sleep_until(at - early);
  while (host_now() < at) {
  }
}

}  // namespace mocap::bench
