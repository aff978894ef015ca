#pragma once

#include "base/time.h"

namespace mocap::retrack {

/// A part of a take from `from` to `to`, on the host's clock of the recording; both included.
struct Span {
  Timestamp from = Timestamp::min();
  Timestamp to = Timestamp::max();

  bool has(Timestamp at) const { return at >= from && at <= to; }
};

}  // namespace mocap::retrack
