#pragma once

#include <cstdint>

namespace mocap {

/// Size of a recording. Data in a buffer are counted; data that a failed write removed are not.
struct RecordingSize {
  std::uint64_t bytes = 0;
  std::uint64_t records = 0;  ///< snapshots or images
};

}  // namespace mocap
