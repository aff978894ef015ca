#pragma once

#include <chrono>
#include <cstdint>

namespace mocap {

using Duration = std::chrono::nanoseconds;

/// An instant on the host's monotonic clock (CLOCK_MONOTONIC).
using Timestamp = std::chrono::time_point<std::chrono::steady_clock, Duration>;

/// Reads the host's monotonic clock. No step of the pipeline calls this: a step takes time as an argument.
Timestamp host_now() noexcept;

/// UTC minus host clock at this moment: add it to a Timestamp's count to get nanoseconds since the Unix epoch.
Duration utc_minus_host() noexcept;

constexpr Timestamp from_ns(std::int64_t ns) noexcept { return Timestamp{Duration{ns}}; }
constexpr std::int64_t to_ns(Timestamp at) noexcept { return at.time_since_epoch().count(); }

constexpr double to_s(Duration span) noexcept { return std::chrono::duration<double>(span).count(); }
constexpr double to_us(Duration span) noexcept { return std::chrono::duration<double, std::micro>(span).count(); }

/// Rounds to the nearest nanosecond.
constexpr Duration from_s(double seconds) noexcept {
  return std::chrono::round<Duration>(std::chrono::duration<double>(seconds));
}

}  // namespace mocap
