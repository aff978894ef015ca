#pragma once

#include <cstdint>

#include "base/time.h"

namespace mocap {

/// The time of a PTP grandmaster as a line of a machine's monotonic clock, near one of its instants.
struct PtpLine {
  std::uint64_t grandmaster = 0;  ///< clock identity (IEEE 1588)
  Timestamp at;                   ///< monotonic clock of the machine
  Duration ptp{};                 ///< time of the grandmaster at `at`, since its epoch
  double rate = 0.0;              ///< seconds that PTP gains per second of the machine's clock
  Duration uncertainty{};         ///< standard deviation of `ptp`, for equal delays of the network in both directions
};

}  // namespace mocap
