#pragma once

#include <cstdint>
#include <filesystem>

#include "base/result.h"
#include "lib/cli/app.h"

namespace mocap::bench {

struct NodesBenchSettings {
  int nodes = 8;
  int cameras = 8;  ///< of each node
  int markers = 300;
  double rate_hz = 120.0;
  double seconds = 10.0;
  std::filesystem::path marker_set;  ///< of each person
};

struct NodesBenchFigures {
  std::uint64_t sets = 0;
  double complete_share = 0.0;       ///< of the sets: with a view of every camera
  double fused_share = 0.0;          ///< of the sets: the others were skipped because the fusion thread was late
  double lost_image_share = 0.0;     ///< of the images that the nodes sent
  double dropped_image_share = 0.0;  ///< of the same: received, and dropped because the fusion thread was late
  double blobs_per_set = 0.0;
  double fusion_cpu_ms = 0.0;  ///< processor time of the fusion thread for each fused set
  double fusion_cpu_p99_ms = 0.0;
  double host_cpu_share = 0.0;  ///< of the host's threads, in cores
  double link_cpu_share = 0.0;  ///< of ZeroMQ's threads, host and nodes together, in cores
  double exposed_to_sent_p50_us = 0.0;
  double exposed_to_sent_p99_us = 0.0;
};

/// Runs a fusion host and nodes in this process, with real sockets between them. The nodes send blobs that were
/// computed before, so that only what a fusion host does is measured, beside the sending.
Result<NodesBenchFigures> run_nodes_bench(const NodesBenchSettings& settings);

/// Adds the subcommand `mocap-bench nodes` with its options.
cli::App* add_nodes_bench(cli::App& app, NodesBenchSettings& settings);
int print_nodes_bench(const NodesBenchSettings& settings, bool json);

}  // namespace mocap::bench
