#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "bench/bridges/arrivals.h"
#include "lib/cli/app.h"

namespace mocap::bench {

struct BridgesBenchSettings {
  double seconds = 10.0;  ///< measured for each protocol
  int clients = 10;       ///< receivers of each protocol
  int subjects = 3;
  double rate_hz = 120.0;
  std::string only;                  ///< protocol to measure; empty: all
  std::filesystem::path marker_set;  ///< of each subject
};

struct BridgeFigures {
  std::string protocol;
  AddedFigures added;
  double cpu_share = 0.0;  ///< of one processor, used by the bridge
};

struct BridgesBenchFigures {
  std::vector<BridgeFigures> bridges;
  /// A thread of this process that sends each message of the feed, as it is, to as many UDP receivers.
  BridgeFigures reference;
  double load = 0.0;  ///< load average of the machine before the measurement
};

/// Runs each bridge program beside a feed and receivers in this process, one after the other. Fails with Timeout if a
/// receiver gets no frame.
Result<BridgesBenchFigures> run_bridges_bench(const BridgesBenchSettings& settings);

/// Adds the subcommand `mocap-bench bridges` with its options.
cli::App* add_bridges_bench(cli::App& app, BridgesBenchSettings& settings);
int print_bridges_bench(const BridgesBenchSettings& settings, bool json);

}  // namespace mocap::bench
