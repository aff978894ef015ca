#pragma once

#include <cstdint>

namespace mocap {

/// Source of a camera's exposure times on the host's clock.
enum class ClockSource : std::uint8_t {
  Unknown,   ///< not known yet, or the camera does not report it
  Receipts,  ///< the camera's clock, mapped to the host's by the times of arrival
  Camera,    ///< the camera's own clock, which is synchronised with the host's
  Lost,      ///< the camera's own clock is not plausible; mapped by the times of arrival
  Ptp,       ///< the clock of the camera's node: node and host follow one PTP grandmaster
};

}  // namespace mocap
