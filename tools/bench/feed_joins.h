#pragma once

#include "base/result.h"

namespace mocap::bench {

/// How listeners came to a feed that runs, one after the other.
struct JoinFigures {
  int joins = 0;
  int described_first = 0;   ///< of them: the first message was the description
  double periods_p50 = 0.0;  ///< from the call that connects to the first snapshot, in periods of the feed
  double periods_p99 = 0.0;
  double periods_max = 0.0;
};

/// Joins a feed over TCP on loopback at instants that have nothing to do with its beat. `keys`: with CURVE. Fails with
/// Timeout when one of them hears nothing for 10 s.
Result<JoinFigures> measure_joins(int joins, double rate_hz, bool keys);

}  // namespace mocap::bench
