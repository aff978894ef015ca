#pragma once

#include <atomic>
#include <cstdint>

namespace mocap {

/// What happened to one camera's stream below the level of frames, since the process began; nought where a camera
/// cannot tell. The camera's thread writes, any thread reads.
struct StreamCounters {
  std::atomic<std::uint64_t> completed_frames{0};  ///< came whole
  std::atomic<std::uint64_t> failed_frames{0};     ///< came broken
  std::atomic<std::uint64_t> underruns{0};         ///< came when every buffer was in use
  std::atomic<std::uint64_t> resent_packets{0};    ///< were lost, asked for again and came
  std::atomic<std::uint64_t> missing_packets{0};   ///< never came
};

}  // namespace mocap
