#pragma once

#include <cstddef>
#include <string>

#include "base/time.h"

namespace mocap {

/// One entry of a shot list: a take that is planned.
struct Shot {
  std::string name;   ///< of the take
  std::string slate;  ///< empty: that of the last take
  std::string notes;
  Duration length{};  ///< zero: the take ends when it is stopped
  bool done = false;  ///< a take of this shot was started and not cancelled

  friend bool operator==(const Shot&, const Shot&) = default;
};

/// Largest shot list, so that it fits into one request of 64 KiB.
inline constexpr std::size_t kMaxShots = 500;
inline constexpr std::size_t kMaxShotList_bytes = 48 * 1024;

}  // namespace mocap
