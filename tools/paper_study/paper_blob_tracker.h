#pragma once

#include <cstdint>
#include <memory>

#include "module/blob_tracker.h"
#include "track2d/blob_track_inspection.h"
#include "track2d/following_blob_tracker.h"

namespace mocap::paper_study {

/// The preset `paper`: the original trackers of the study, including their weaknesses.
struct PaperTrackSettings {
  track2d::TrackMethod method = track2d::TrackMethod::AlphaBeta;  ///< AlphaBeta, Kalman or Condensation
  int width_px = 640;
  int height_px = 480;
  std::uint64_t seed = 1;  ///< for CONDENSATION
};

/// Makes a tracker that assigns labels once: each blob of the first frame with blobs gets a label (in the study by an
/// operator's click). In the order of the labels, the nearest free blob inside the gate is assigned to each label. A
/// label never ends. The tracker implements BlobTrackInspection; track() does not allocate.
std::unique_ptr<BlobTracker> make_paper_blob_tracker(const PaperTrackSettings& settings);

}  // namespace mocap::paper_study
