#pragma once

#include <cstdint>

namespace mocap {

/// By what a camera's exposures are told on the host's clock.
enum class ClockSource : std::uint8_t {
  Unknown,   ///< not told yet, or by a camera that cannot tell
  Receipts,  ///< its clock is learnt from the times of receipt
  Camera,    ///< its own clock, which keeps the host's time
  Lost,      ///< should be its own, and cannot be believed: by the receipts
};

}  // namespace mocap
