#pragma once

#include <atomic>
#include <cstdint>

#include "model/clock/clock_source.h"

namespace mocap {

/// Transport statistics of one camera since the start of the process. A counter that the driver cannot provide stays 0.
/// The camera's thread writes, any thread reads.
struct StreamCounters {
  std::atomic<std::uint64_t> completed_frames{0};  ///< images that arrived complete
  std::atomic<std::uint64_t> failed_frames{0};     ///< images that arrived incomplete
  std::atomic<std::uint64_t> underruns{0};         ///< images that arrived while no buffer was free
  std::atomic<std::uint64_t> resent_packets{0};    ///< packets that arrived after a resend request
  std::atomic<std::uint64_t> missing_packets{0};   ///< packets that never arrived
  std::atomic<std::uint64_t> repeated_frames{0};   ///< images that arrived a second time and were left out
  std::atomic<std::uint64_t> clock_leaps{0};  ///< times that the camera's clock wrapped, jumped, ran back or stopped
  std::atomic<double> clock_uncertainty_us{0.0};  ///< of exposure times on the host's clock; 0: unknown
  std::atomic<ClockSource> clock_source{ClockSource::Unknown};
  std::atomic<bool> chunk_times{false};  ///< the camera writes the start of the exposure into the image
};

}  // namespace mocap
