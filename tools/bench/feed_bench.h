#pragma once

#include <cstddef>

#include "base/result.h"
#include "feed_joins.h"
#include "lib/cli/app.h"

namespace mocap::bench {

struct FeedBenchSettings {
  int subscribers = 1;
  double rate_hz = 120.0;
  double seconds = 5.0;
  int joins = 200;  ///< late ones, one after the other, without keys and with
};

struct FeedBenchFigures {
  double received_share = 0.0;  ///< of the messages that each subscriber should have got, of all of them
  double least_share = 0.0;     ///< of the subscriber that got least
  double publish_p50_us = 0.0;  ///< the call that encodes and hands to ZeroMQ
  double publish_p99_us = 0.0;
  double age_p50_us = 0.0;  ///< from that call's beginning to received
  double age_p99_us = 0.0;
  double encode_us = 0.0;       ///< median: snapshot to bytes
  std::size_t bytes = 0;        ///< of a message
  double raw_p50_us = 0.0;      ///< a raw ZeroMQ message of the same size, from send to received, in the same run
  double one_way_p50_us = 0.0;  ///< a snapshot to a single subscriber, turn about with these
  JoinFigures open_joins;
  JoinFigures key_joins;
};

/// One subject of 60 markers and 24 bones, seen by 8 cameras, over TCP on loopback.
Result<FeedBenchFigures> run_feed_bench(const FeedBenchSettings& settings);

/// `mocap-bench feed` and its options.
cli::App* add_feed_bench(cli::App& app, FeedBenchSettings& settings);
int print_feed_bench(const FeedBenchSettings& settings, bool json);

}  // namespace mocap::bench
