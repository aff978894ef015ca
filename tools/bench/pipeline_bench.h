#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "base/result.h"

namespace mocap::bench {

struct PipelineBenchSettings {
  int cameras = 8;
  int width_px = 640;
  int height_px = 480;
  double rate_hz = 120.0;
  double seconds = 10.0;
  std::filesystem::path marker_set;  ///< worn by the simulated subject
  std::uint64_t seed = 1;
};

/// What the chain cost, from the last blob of a set received to its snapshot handed to ZeroMQ.
struct PipelineBenchFigures {
  std::uint64_t sets = 0;
  double complete_share = 0.0;
  double labelled_share = 0.0;  ///< of the markers of all snapshots, those with a place
  double p50_us = 0.0;
  double p99_us = 0.0;
  double max_us = 0.0;
  std::uint64_t dropped = 0;      ///< images, sets and snapshots that were left out for want of room or time
  std::uint64_t allocations = 0;  ///< of the daemon's threads while it was measured
};

/// Runs the whole daemon in this process on synthetic cameras at their pace, with a real ZeroMQ feed. The first two
/// seconds are not measured: the subject is found in its T-pose then.
Result<PipelineBenchFigures> run_pipeline_bench(const PipelineBenchSettings& settings);

}  // namespace mocap::bench
