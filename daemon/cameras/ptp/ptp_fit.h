#pragma once

#include <cstdint>
#include <optional>

#include "base/bounded_vector.h"
#include "base/time.h"
#include "model/clock/ptp_line.h"

namespace mocap::cameras {

/// The line of least squares through the last readings of PTP's time. Its uncertainty is that of the fit at the instant
/// asked for, from the residuals, so that it grows with the distance from the readings.
///
/// Deterministic. Never allocates. One thread.
///
/// Source: Draper and Smith, "Applied Regression Analysis" (1998), section 3.1: variance of a predicted mean.
class PtpFit {
 public:
  /// Adds a reading: PTP's time at an instant of the monotonic clock. Another grandmaster begins anew; a reading that
  /// is not later than the last one is left out.
  void add(std::uint64_t grandmaster, Timestamp at, Duration ptp);
  void clear() { readings_.clear(); }

  /// Empty with fewer than 4 readings, and more than 5 s after the last one.
  std::optional<PtpLine> line(Timestamp at) const;

 private:
  struct Reading {
    Timestamp at;
    Duration ptp;
  };
  static constexpr std::size_t kReadings = 16;  // one a second

  std::uint64_t grandmaster_ = 0;
  BoundedVector<Reading, kReadings> readings_;  // the newest is the last
};

}  // namespace mocap::cameras
