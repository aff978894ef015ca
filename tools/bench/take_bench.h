#pragma once

#include <cstdint>
#include <filesystem>

#include "base/result.h"
#include "bench/scene_cameras.h"
#include "lib/cli/app.h"

namespace mocap::bench {

struct TakeBenchSettings {
  SceneOfBench scene;
  int subscribers = 20;
  double seconds = 60.0;         ///< of the take
  double idle_seconds = 20.0;    ///< without a take, half before and half after it: the comparison
  std::filesystem::path folder;  ///< of the take; empty: a temporary folder
};

struct TakeBenchFigures {
  std::uint64_t sets = 0;                             ///< of the take
  std::uint64_t feed_lost = 0;                        ///< snapshots that the feed or a subscriber lost during the take
  std::uint64_t feed_lost_by_fusion = 0;              ///< of them: sets that the fusion thread came too late for
  std::uint64_t take_lost = 0;                        ///< sets and images that the take lost
  double bytes_per_s = 0.0;                           ///< of the take's file
  double publish_p50_us = 0.0, publish_p99_us = 0.0;  ///< last blob detected to ZeroMQ, while recording
  double idle_publish_p50_us = 0.0, idle_publish_p99_us = 0.0;  ///< the same, not recording
  double tracked_share = 0.0;  ///< share of snapshots in which every subject is tracked
  double retrack_speed = 0.0;  ///< seconds of the take tracked again in one second by one thread
  std::uint64_t retrack_sets = 0;
  std::uint64_t retrack_equal = 0;  ///< snapshots that are the recorded ones, byte for byte
};

/// Runs the whole daemon in this process on simulated blobs in real time, with subscribers, records a take, and tracks
/// it again.
Result<TakeBenchFigures> run_take_bench(const TakeBenchSettings& settings);

/// Adds the subcommand `mocap-bench take` with its options.
cli::App* add_take_bench(cli::App& app, TakeBenchSettings& settings);
int print_take_bench(const TakeBenchSettings& settings, bool json);

}  // namespace mocap::bench
