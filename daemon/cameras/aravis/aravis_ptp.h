#pragma once

#include <atomic>
#include <optional>
#include <stop_token>
#include <string>

#include "base/result.h"
#include "base/time.h"

typedef struct _ArvCamera ArvCamera;  // NOLINT(bugprone-reserved-identifier): Aravis's own name, for pointers only

namespace mocap::cameras {

/// PTP state of a camera, as its features report it.
struct PtpState {
  bool enabled = false;
  std::string role;                ///< Slave, Master, Listening, ... in the camera's words
  std::optional<Duration> offset;  ///< from its master's clock
};

/// Reads the PTP state by the features of the standard (SFNC: PtpEnable, PtpStatus, PtpOffsetFromMaster) or by their
/// older names (GevIEEE1588, GevIEEE1588Status). Absent if the camera has neither.
std::optional<PtpState> read_ptp(ArvCamera* camera);

/// Reads the camera's clock (SFNC: TimestampLatch, TimestampLatchValue, or GevTimestampControlLatch,
/// GevTimestampValue). Absent if the camera has neither.
std::optional<Duration> read_clock(ArvCamera* camera);

/// Enables PTP and waits up to 8 s until the camera is slave or master. Fails with Unsupported if the camera has no
/// PTP, and with Timeout, naming the current role, if the camera is neither.
Status enable_ptp(ArvCamera* camera);

/// Compares successive PTP states of a camera and returns a log line when the state becomes worse or better: the camera
/// is neither slave nor master any more, or is more than 100 us off its master. A camera that does not answer is not
/// judged here.
class PtpWatch {
 public:
  /// The line to log, with a remedy; absent if nothing changed.
  std::optional<std::string> follow(const PtpState& state);

  /// True if the state of the last follow() was good.
  bool is_well() const { return well_; }

 private:
  bool well_ = true;
};

/// Reads the PTP state every 2 s, logs the lines of PtpWatch and writes `is_well`, until `stop`. Needs a thread of its
/// own: reading a lost camera blocks for some seconds.
void watch_ptp(ArvCamera* camera, const std::string& who, std::atomic<bool>& is_well, const std::stop_token& stop);

}  // namespace mocap::cameras
