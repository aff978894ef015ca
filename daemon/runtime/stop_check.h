#pragma once

#include <chrono>

#include "base/time.h"

namespace mocap::runtime {

/// Longest sleep of a loop: a thread sees a stop request within this time, also if it missed a signal.
inline constexpr Duration kStopCheckPeriod = std::chrono::milliseconds(50);

}  // namespace mocap::runtime
