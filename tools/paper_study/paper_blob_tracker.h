#pragma once

#include <cstdint>
#include <memory>

#include "module/blob_tracker.h"
#include "track2d/blob_track_inspection.h"
#include "track2d/following_blob_tracker.h"

namespace mocap::paper_study {

/// The preset `paper`: the trackers of the study as they were, their weaknesses included.
struct PaperTrackSettings {
  track2d::TrackMethod method = track2d::TrackMethod::AlphaBeta;  ///< AlphaBeta, Kalman or Condensation
  int width_px = 640;
  int height_px = 480;
  std::uint64_t seed = 1;  ///< CONDENSATION
};

/// Makes a tracker that names things once: each blob of the first frame that has any gets a label (in the study the
/// operator's click did that), and nothing is named later. Each label, in the order of naming, takes the nearest blob
/// inside its gate, and that blob is gone for the others. A label never becomes lost. It implements
/// BlobTrackInspection. `track` does not allocate.
std::unique_ptr<BlobTracker> make_paper_blob_tracker(const PaperTrackSettings& settings);

}  // namespace mocap::paper_study
