#pragma once

#include <cmath>
#include <cstdint>

namespace mocap::bench {

/// The exposures of the frames of a feed, which is how receivers of protocols without frame numbers recognise them.
struct FrameTimes {
  std::int64_t first_ns = 0;           ///< exposure of frame 0 on the host's monotonic clock
  std::int64_t period_ns = 1;          ///< at least 1
  std::int64_t utc_minus_host_ns = 0;  ///< clock of the protocols that have UTC

  std::int64_t exposed_ns(std::uint64_t number) const {
    return first_ns + static_cast<std::int64_t>(number) * period_ns;
  }
  /// The frame whose exposure is nearest to this time on the monotonic clock; 0 before the first frame.
  std::uint64_t number_at(std::int64_t exposed_ns) const {
    const double periods = static_cast<double>(exposed_ns - first_ns) / static_cast<double>(period_ns);
    return periods > 0.0 ? static_cast<std::uint64_t>(std::llround(periods)) : 0;
  }
};

}  // namespace mocap::bench
