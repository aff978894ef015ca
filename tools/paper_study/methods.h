#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "model/bounds.h"
#include "module/blob_tracker.h"
#include "paper_study/clip.h"

namespace mocap::paper_study {

/// What a tracker is made for.
struct TrackerNeeds {
  std::uint64_t seed = 1;  ///< of those that draw random numbers
  int width_px = kWidth_px;
  int height_px = kHeight_px;
  std::size_t max_blobs = kMaxBlobs;
};

/// A way of tracking that is judged.
struct Method {
  std::string name;     ///< as in reports: "paper_kalman"
  bool paper_detector;  ///< sees with the study's detector; otherwise with the daemon's
  std::unique_ptr<BlobTracker> (*make)(const TrackerNeeds& needs);
};

/// The study's trackers (paper_*), ours with their default settings (mocap_*), and `default`: the tracker that the
/// daemon runs when nothing is set.
std::span<const Method> methods();

}  // namespace mocap::paper_study
