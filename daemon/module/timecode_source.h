#pragma once

#include "base/time.h"
#include "model/clock/timecode_health.h"

namespace mocap {

/// A source of timecode: a signal or a clock.
///
/// The timecode thread owns a TimecodeSource and makes all calls.
class TimecodeSource {
 public:
  virtual ~TimecodeSource() = default;

  /// Waits at most about `patience` for news of the source.
  virtual void listen(Duration patience) = 0;

  /// The relation of timecode to the host's clock, and the state of the source, at `now`.
  virtual TimecodeHealth state(Timestamp now) = 0;
};

}  // namespace mocap
