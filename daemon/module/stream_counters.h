#pragma once

#include <atomic>
#include <cstdint>

#include "model/clock_source.h"

namespace mocap {

/// What happened to one camera's stream below the level of frames, since the process began; nought where a camera
/// cannot tell. The camera's thread writes, any thread reads.
struct StreamCounters {
  std::atomic<std::uint64_t> completed_frames{0};  ///< came whole
  std::atomic<std::uint64_t> failed_frames{0};     ///< came broken
  std::atomic<std::uint64_t> underruns{0};         ///< came when every buffer was in use
  std::atomic<std::uint64_t> resent_packets{0};    ///< were lost, asked for again and came
  std::atomic<std::uint64_t> missing_packets{0};   ///< never came
  std::atomic<std::uint64_t> repeated_frames{0};   ///< came a second time, and were left out
  std::atomic<std::uint64_t> clock_leaps{0};       ///< the camera's clock wrapped, leapt, ran back or stood still
  std::atomic<double> clock_uncertainty_us{0.0};   ///< of its exposures on the host's clock; 0: not told
  std::atomic<ClockSource> clock_source{ClockSource::Unknown};
  std::atomic<bool> chunk_times{false};  ///< it writes each exposure's begin into the image
};

}  // namespace mocap
