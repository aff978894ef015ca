#pragma once

#include "base/result.h"

namespace mocap::bench {

/// Latency of subscribers that join a running feed, one after the other.
struct JoinFigures {
  int joins = 0;
  int described_first = 0;   ///< joins whose first message was the description
  double periods_p50 = 0.0;  ///< time from connect to the first snapshot, in periods of the feed
  double periods_p99 = 0.0;
  double periods_max = 0.0;
};

/// Joins a feed over TCP on loopback at instants that are not synchronised with the feed. `keys`: use CURVE. Fails with
/// Timeout if a subscriber receives no snapshot within 10 s.
Result<JoinFigures> measure_joins(int joins, double rate_hz, bool keys);

}  // namespace mocap::bench
