#pragma once

#include <cstdint>

#include "base/bounded_vector.h"

namespace mocap {

enum class TakeState {
  None,     ///< no take since the start of the daemon
  Waiting,  ///< starts at a time or after a countdown
  Recording,
  Ended,      ///< the file is complete and on the disk
  Failed,     ///< ended early
  Cancelled,  ///< the file was deleted
};

/// May a take be used as it is?
enum class TakeQuality {
  Unknown,
  Good,
  Look,  ///< look at the reasons first
  Bad,
};

/// The take that is recorded, or the last one. In place: a copy does not allocate.
struct TakeHealth {
  TakeState state = TakeState::None;
  BoundedVector<char, 255> name;
  BoundedVector<char, 1023> path;  ///< empty: the file does not exist yet
  double seconds = 0.0;
  std::uint64_t size_bytes = 0;
  std::uint64_t sets = 0;         ///< snapshots in the file
  std::uint64_t lost_sets = 0;    ///< gaps in the numbers of the sets
  std::uint64_t lost_images = 0;  ///< images whose blobs the take lacks because the recording was too slow
  TakeQuality quality = TakeQuality::Unknown;
  BoundedVector<char, 511> reasons;  ///< of the quality, separated by "; "; empty: good
  BoundedVector<char, 511> message;  ///< why the take failed
  std::uint64_t takes = 0;           ///< takes since the start of the daemon
};

}  // namespace mocap
