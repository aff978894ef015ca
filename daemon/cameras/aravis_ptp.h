#pragma once

#include <optional>
#include <string>

#include "base/result.h"
#include "base/time.h"

typedef struct _ArvCamera ArvCamera;  // NOLINT(bugprone-reserved-identifier): Aravis's own name, for pointers only

namespace mocap::cameras {

/// What a camera says of its PTP clock.
struct PtpState {
  bool enabled = false;
  std::string role;                ///< Slave, Master, Listening, ... as the camera calls it
  std::optional<Duration> offset;  ///< from its master's clock
};

/// Reads the state by the standard's features (SFNC: PtpEnable, PtpStatus, PtpOffsetFromMaster) or their older names
/// (GevIEEE1588, GevIEEE1588Status). Nothing where the camera has neither.
std::optional<PtpState> read_ptp(ArvCamera* camera);

/// Enables PTP and waits, some seconds at most, until the camera is slave or master. Fails with Unsupported where it
/// has no PTP, and with Timeout, naming the role that it has, where it finds none of those two.
Status enable_ptp(ArvCamera* camera);

}  // namespace mocap::cameras
