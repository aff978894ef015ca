#pragma once

#include <chrono>
#include <ctime>

#include "base/time.h"

namespace mocap {

/// Processor time that the calling thread has used.
inline Duration thread_time() {
  timespec used{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &used);
  return std::chrono::seconds(used.tv_sec) + std::chrono::nanoseconds(used.tv_nsec);
}

}  // namespace mocap
