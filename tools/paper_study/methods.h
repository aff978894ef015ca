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

/// Parameters for the construction of a tracker.
struct TrackerNeeds {
  std::uint64_t seed = 1;  ///< for trackers that use random numbers
  int width_px = kWidth_px;
  int height_px = kHeight_px;
  std::size_t max_blobs = kMaxBlobs;
};

/// A tracking method that the study evaluates.
struct Method {
  std::string name;     ///< name in reports, for example "paper_kalman"
  bool paper_detector;  ///< uses the study's detector; otherwise the daemon's detector
  std::unique_ptr<BlobTracker> (*make)(const TrackerNeeds& needs);
};

/// The study's trackers (paper_*), our trackers with default settings (mocap_*), and `default`, the default tracker of
/// the daemon.
std::span<const Method> methods();

}  // namespace mocap::paper_study
