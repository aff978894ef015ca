#pragma once

#include <filesystem>

#include "base/result.h"
#include "bench/bridges/arrivals.h"
#include "lib/cli/app.h"

namespace mocap::bench {

struct RelayBenchSettings {
  double seconds = 10.0;  ///< measured
  int subscribers = 300;
  int subjects = 1;
  double rate_hz = 30.0;
  bool tls = false;  ///< from the relay to the server and from the server to each subscriber
  std::filesystem::path server = "/usr/sbin/nats-server";
  std::filesystem::path marker_set;  ///< of each subject
};

struct RelayBenchFigures {
  AddedFigures added;                                    ///< against a subscriber of the feed's lite topics
  double relay_cpu_share = 0.0, server_cpu_share = 0.0;  ///< of one processor
  double load = 0.0;                                     ///< load average of the machine before the measurement
};

/// Runs mocap-relay and a NATS server beside a feed and subscribers of the server in this process. Fails with NotFound
/// (a program is missing) and Timeout (a subscriber gets no frame).
Result<RelayBenchFigures> run_relay_bench(const RelayBenchSettings& settings);

/// Adds the subcommand `mocap-bench relay` with its options.
cli::App* add_relay_bench(cli::App& app, RelayBenchSettings& settings);
int print_relay_bench(const RelayBenchSettings& settings, bool json);

}  // namespace mocap::bench
