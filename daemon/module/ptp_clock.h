#pragma once

#include <optional>

#include "base/result.h"
#include "base/time.h"
#include "model/clock/ptp_line.h"

namespace mocap {

/// The clock of this machine beside that of a PTP grandmaster.
class PtpClock {
 public:
  virtual ~PtpClock() = default;

  /// Measures once. Waits up to a second; the PTP thread calls it. Fails with NotFound where PTP does not run, and as
  /// the source of the measurement does.
  virtual Status measure() = 0;

  /// PTP's time at an instant near the last measurements; empty if there are too few, or if the last one is too old.
  /// Any thread.
  virtual std::optional<PtpLine> line(Timestamp at) const = 0;
};

}  // namespace mocap
