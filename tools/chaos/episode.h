#pragma once

#include <chrono>
#include <cstdint>
#include <vector>

#include "base/time.h"
#include "chaos/fault.h"

namespace mocap::chaos {

/// One simulated run of the daemon. Everything that happens follows from these values.
struct Episode {
  std::uint64_t seed = 1;
  std::uint32_t cameras = 4;
  std::uint32_t subjects = 2;
  std::uint32_t first_role = 0;  ///< of the first subject, 0 or 1: marker set and motion
  double rate_hz = 60.0;
  bool utc_stamps = false;  ///< the cameras stamp their images with UTC (PTP), else with a clock of their own
  bool fitted = true;       ///< the bodies are known; else the daemon fits them in the T-pose at the start
  Duration patience = std::chrono::milliseconds(30);  ///< [align] patience
  double seconds = 5.5;
  std::vector<Fault> faults;
};

/// Recovery: from this time after the last fault on, every skeleton must be right again.
inline constexpr double kRecovery_s = 1.0;

/// The end of the last fault; 0 without faults.
double end_of_faults_s(const Episode& episode);

/// The episode of a seed.
Episode draw_episode(std::uint64_t seed);

}  // namespace mocap::chaos
