#pragma once

#include <optional>

#include "base/time.h"
#include "model/clock/timecode.h"

namespace mocap {

/// The relation between the host's clock and timecode: a straight line.
struct TimecodeClock {
  Timecode format;               ///< its rate and counting; the other numbers have no meaning
  Timestamp at;                  ///< an instant
  double frames_at = 0.0;        ///< timecode frames since midnight at that instant
  double frames_per_s = 30.0;    ///< measured: the real rate of the source on the host's clock
  double exposures_per_s = 0.0;  ///< of the cameras, to count subframes; 0: unknown, the subframe is always 0
  Timestamp valid_until{Timestamp::max()};  ///< the source is not trusted for longer without a new measurement
};

/// The timecode frames since midnight at an instant, 0 to less than the frames of a day.
double position_at(const TimecodeClock& clock, Timestamp at) noexcept;

/// The timecode of an exposure; empty after `valid_until`. An exposure that precedes the start of a timecode frame by
/// less than a tenth of the exposure period belongs to that frame, so that the jitter of cameras that are triggered by
/// the timecode does not change the frame.
std::optional<Timecode> timecode_at(const TimecodeClock& clock, Timestamp at) noexcept;

/// The first instant from `now` on at which a timecode frame starts. Requires a valid timecode of the clock's rate.
Timestamp time_of(const TimecodeClock& clock, const Timecode& wanted, Timestamp now) noexcept;

}  // namespace mocap
