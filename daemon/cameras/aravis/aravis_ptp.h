#pragma once

#include <atomic>
#include <optional>
#include <stop_token>
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

/// What the camera's clock shows now (SFNC: TimestampLatch, TimestampLatchValue, or GevTimestampControlLatch,
/// GevTimestampValue). Nothing where it has neither.
std::optional<Duration> read_clock(ArvCamera* camera);

/// Enables PTP and waits, some seconds at most, until the camera is slave or master. Fails with Unsupported where it
/// has no PTP, and with Timeout, naming the role that it has, where it finds none of those two.
Status enable_ptp(ArvCamera* camera);

/// Follows what a camera says of its PTP clock and has words for the operator when that changes for worse or better: it
/// is no slave or master any more, or farther than 100 us off its master. A camera that does not answer is told of
/// elsewhere.
class PtpWatch {
 public:
  /// The line to log, with its cure; nothing while all is as it was.
  std::optional<std::string> follow(const PtpState& state);

  /// Whether the clock can be believed, as of the last `follow`.
  bool is_well() const { return well_; }

 private:
  bool well_ = true;
};

/// Reads the camera's state every 2 s, logs as PtpWatch says and keeps `is_well`, until stopped. For a thread of its
/// own: a camera that is gone is waited for, for some seconds.
void watch_ptp(ArvCamera* camera, const std::string& who, std::atomic<bool>& is_well, const std::stop_token& stop);

}  // namespace mocap::cameras
