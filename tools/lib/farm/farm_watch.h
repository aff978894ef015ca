#pragma once

#include <cstddef>
#include <functional>

#include "lib/farm/unit.h"

namespace mocap::farm {

struct FarmProgress {
  double share = 0.0;  ///< of the bytes of all takes, 0 to 1
  std::size_t ended = 0;
  std::size_t failed = 0;  ///< of those that ended
  std::size_t units = 0;
};

/// Called by the thread that waits for the units.
struct FarmWatch {
  std::function<void(const FarmProgress&)> progress;          ///< several times a second
  std::function<void(const Unit&, const UnitResult&)> ended;  ///< once for each unit that was begun
  std::function<int()> stops;  ///< how often the user asked for an end: 1: end soon, 2: at once
};

}  // namespace mocap::farm
