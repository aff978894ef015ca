#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"
#include "lib/cli/app.h"
#include "model/health.h"

namespace mocap::bench {

struct HostileBenchSettings {
  double rate_hz = 120.0;
  double seconds = 4.0;  ///< duration of each attack
  std::uint64_t seed = 1;
};

struct AttackFigures {
  std::string name;
  double worst_gap_ms = 0.0;    ///< between two snapshots at a well-behaved subscriber; includes one period
  double publish_max_ms = 0.0;  ///< longest call of publish(); the rest of a gap is waiting for a processor
  double growth_mb = 0.0;  ///< memory of the feed's process: maximum during this attack minus value before all attacks
  FeedHealth counted;      ///< increase of the feed's health counters
};

struct HostileBenchFigures {
  double quiet_gap_ms = 0.0;  ///< worst gap without an attack, caused by the machine
  double worst_gap_ms = 0.0;
  double growth_mb = 0.0;
  bool alive = false;
  std::vector<AttackFigures> attacks;
};

/// Runs a feed in a child process and one attack after the other while a subscriber measures the gaps.
Result<HostileBenchFigures> run_hostile_bench(const HostileBenchSettings& settings);

/// Adds the subcommand `mocap-bench hostile` with its options.
cli::App* add_hostile_bench(cli::App& app, HostileBenchSettings& settings);
int print_hostile_bench(const HostileBenchSettings& settings, bool json);

}  // namespace mocap::bench
