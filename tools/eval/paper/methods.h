#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "module/blob_tracker.h"

namespace mocap::eval::paper {

/// A way of tracking that is judged.
struct Method {
  std::string name;     ///< as in reports: "paper_kalman"
  bool paper_detector;  ///< sees with the study's detector; otherwise with the daemon's
  std::unique_ptr<BlobTracker> (*make)(std::uint64_t seed);
};

/// The study's trackers (paper_*), ours with their default settings (mocap_*), and `default`: the tracker that the
/// daemon runs when nothing is set.
std::span<const Method> methods();

}  // namespace mocap::eval::paper
