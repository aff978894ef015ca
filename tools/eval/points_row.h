#pragma once

#include <memory>
#include <vector>

#include "lib/simworld/points_world.h"
#include "model/camera_model.h"
#include "module/blob_tracker.h"
#include "module/marker_tracker.h"
#include "module/matcher.h"
#include "module/triangulator.h"
#include "synchronise/frame_aligner.h"

namespace mocap::eval {

/// The daemon's stages from blobs to tracks, with their default settings.
class PointsRow {
 public:
  explicit PointsRow(const Rig& rig);

  /// Takes in one instant; false where no image of it came. The results are borrowed until the next call.
  bool step(const simworld::SeenInstant& seen);

  const FrameSet& set() const { return set_; }
  const Expected& expected() const { return expected_; }
  const Matches& matches() const { return *matches_; }
  const Markers& markers() const { return *markers_; }
  const TrackedMarkers& tracked() const { return *tracked_; }

 private:
  std::vector<std::unique_ptr<BlobTracker>> blob_trackers_;  // by camera
  BlobFrame frame_;
  synchronise::FrameAligner aligner_;
  std::unique_ptr<Matcher> matcher_;
  std::unique_ptr<Triangulator> triangulator_;
  std::unique_ptr<MarkerTracker> tracker_;
  FrameSet set_;
  Expected expected_;
  const Matches* matches_ = nullptr;
  const Markers* markers_ = nullptr;
  const TrackedMarkers* tracked_ = nullptr;
};

}  // namespace mocap::eval
