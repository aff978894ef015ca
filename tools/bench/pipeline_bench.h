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
  std::filesystem::path marker_set;  ///< of the simulated subject
  std::uint64_t seed = 1;
};

/// Latency from the reception of a set's last blob to the transfer of the snapshot to ZeroMQ.
struct PipelineBenchFigures {
  std::uint64_t sets = 0;
  double complete_share = 0.0;
  double labelled_share = 0.0;  ///< share of the markers of all snapshots that have a position
  double p50_us = 0.0;
  double p99_us = 0.0;
  double max_us = 0.0;
  std::uint64_t dropped = 0;      ///< images, sets and snapshots dropped because of a full queue or lack of time
  std::uint64_t allocations = 0;  ///< heap allocations of the daemon's threads during the measurement
};

/// Runs the whole daemon in this process on synthetic cameras in real time, with a real ZeroMQ feed. The first two
/// seconds, in which the subject is identified in its T-pose, are not measured.
Result<PipelineBenchFigures> run_pipeline_bench(const PipelineBenchSettings& settings);

}  // namespace mocap::bench
