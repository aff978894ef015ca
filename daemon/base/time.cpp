#include "base/time.h"

#include <ctime>

namespace mocap {
namespace {

Duration read(clockid_t clock) noexcept {
  timespec now{};
  clock_gettime(clock, &now);
  return std::chrono::seconds(now.tv_sec) + std::chrono::nanoseconds(now.tv_nsec);
}

}  // namespace

Timestamp host_now() noexcept { return Timestamp{read(CLOCK_MONOTONIC)}; }

Duration utc_minus_host() noexcept {
  // The mean of two host readings around the UTC one: half of the time that reading takes cancels.
  const Duration before = read(CLOCK_MONOTONIC);
  const Duration utc = read(CLOCK_REALTIME);
  const Duration after = read(CLOCK_MONOTONIC);
  return utc - (before + (after - before) / 2);
}

}  // namespace mocap
