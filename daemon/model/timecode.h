#pragma once

#include <cstdint>

namespace mocap {

/// SMPTE timecode (ST 12-1) of one frame.
struct Timecode {
  std::uint32_t hours = 0, minutes = 0, seconds = 0, frames = 0;
  std::uint32_t frames_per_second = 30;  ///< nominal
  bool drop_frame = false;               ///< frame numbers are skipped to match 29.97 Hz
};

}  // namespace mocap
