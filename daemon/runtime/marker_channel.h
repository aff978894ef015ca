#pragma once

#include <atomic>
#include <cstdint>

#include "base/spsc_queue.h"
#include "model/calibration/calibration_markers.h"

namespace mocap::runtime {

/// Markers from the fusion thread to the calibration thread, while the floor is measured.
struct MarkerChannel {
  SpscQueue<CalibrationMarkers> markers{16};  ///< 0.13 s at 120 Hz
  std::atomic<bool> wanted{false};            ///< set by the calibration thread
  std::atomic<std::uint64_t> dropped{0};      ///< instants that found the queue full
};

}  // namespace mocap::runtime
