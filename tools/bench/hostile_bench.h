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
  double seconds = 4.0;  ///< of each attack
  std::uint64_t seed = 1;
};

struct AttackFigures {
  std::string name;
  double worst_gap_ms = 0.0;    ///< between two snapshots at a subscriber that behaves; a period is part of it
  double publish_max_ms = 0.0;  ///< the longest call of publish(): the rest of a gap is waiting for a processor
  double growth_mb = 0.0;       ///< of the feed's process, from before all attacks to the most during this one
  FeedHealth counted;           ///< what the feed's own figures grew by
};

struct HostileBenchFigures {
  double quiet_gap_ms = 0.0;  ///< the worst without any attack: the machine's own
  double worst_gap_ms = 0.0;
  double growth_mb = 0.0;
  bool alive = false;
  std::vector<AttackFigures> attacks;
};

/// A feed in a process of its own; one attack after the other while a subscriber listens.
Result<HostileBenchFigures> run_hostile_bench(const HostileBenchSettings& settings);

/// `mocap-bench hostile` and its options.
cli::App* add_hostile_bench(cli::App& app, HostileBenchSettings& settings);
int print_hostile_bench(const HostileBenchSettings& settings, bool json);

}  // namespace mocap::bench
