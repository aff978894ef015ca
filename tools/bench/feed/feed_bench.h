#pragma once

#include <cstddef>

#include "base/result.h"
#include "bench/feed/feed_joins.h"
#include "lib/cli/app.h"

namespace mocap::bench {

struct FeedBenchSettings {
  int subscribers = 1;
  double rate_hz = 120.0;
  double seconds = 5.0;
  int joins = 200;  ///< number of late joins, one after the other, without and with keys
};

struct FeedBenchFigures {
  double received_share = 0.0;  ///< received / expected messages, over all subscribers
  double least_share = 0.0;     ///< received_share of the worst subscriber
  double publish_p50_us = 0.0;  ///< duration of publish(), which encodes and passes the message to ZeroMQ
  double publish_p99_us = 0.0;
  double age_p50_us = 0.0;  ///< from the call of publish() to the reception
  double age_p99_us = 0.0;
  double encode_us = 0.0;       ///< median: snapshot to bytes
  std::size_t bytes = 0;        ///< size of a message
  double raw_p50_us = 0.0;      ///< age of raw ZeroMQ messages of the same size, in the same run
  double one_way_p50_us = 0.0;  ///< age of snapshots to a single subscriber, sent alternately with the raw messages
  JoinFigures open_joins;
  JoinFigures key_joins;
};

/// Publishes one subject of 60 markers and 24 bones, seen by 8 cameras, over TCP on loopback.
Result<FeedBenchFigures> run_feed_bench(const FeedBenchSettings& settings);

/// Adds the subcommand `mocap-bench feed` with its options.
cli::App* add_feed_bench(cli::App& app, FeedBenchSettings& settings);
int print_feed_bench(const FeedBenchSettings& settings, bool json);

}  // namespace mocap::bench
