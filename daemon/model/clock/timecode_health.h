#pragma once

#include <cstdint>
#include <optional>

#include "base/bounded_vector.h"
#include "base/time.h"
#include "model/clock/timecode_clock.h"

namespace mocap {

enum class TimecodeSourceKind { None, Ltc, Utc };

enum class TimecodeState {
  Searching,  ///< no timecode yet
  Locked,     ///< follows the source
  Coasting,   ///< the signal is interrupted; the timecode goes on at the measured rate
  Lost,       ///< the signal is interrupted for too long: snapshots have no timecode
};

/// The source of timecode and its state. In place: a copy does not allocate.
struct TimecodeHealth {
  TimecodeSourceKind source = TimecodeSourceKind::None;
  TimecodeState state = TimecodeState::Searching;
  Timecode format;                         ///< rate and counting of the configuration
  std::optional<TimecodeClock> clock;      ///< empty: no timecode
  std::optional<Timestamp> last_frame_at;  ///< start of the last LTC frame that agrees with the clock; empty: none
  double drift_ppm = 0.0;                  ///< of the LTC against the host's clock; positive: the LTC is fast
  std::uint64_t frames = 0;                ///< LTC frames that agree with the clock, since the start
  std::uint64_t rejected_frames = 0;       ///< LTC frames that do not
  std::uint64_t jumps = 0;                 ///< changes to another timecode
  BoundedVector<char, 255> sentence;       ///< why there is no timecode, and the remedy; empty: nothing is wrong
};

}  // namespace mocap
