#pragma once

#include <memory>
#include <vector>

#include "lib/simworld/points_world.h"
#include "model/camera_model.h"
#include "model/identity_map.h"
#include "module/blob_tracker.h"
#include "module/marker_tracker.h"
#include "module/matcher.h"
#include "module/triangulator.h"
#include "synchronise/frame_aligner.h"

namespace mocap::eval {

/// The daemon's steps from blobs to 3D tracks, with default settings.
class MarkerPipeline {
 public:
  explicit MarkerPipeline(const Rig& rig);

  /// Processes one instant. Returns false if all its images were lost. The results are valid until the next call.
  bool step(const simworld::SeenInstant& seen);

  const FrameSet& set() const { return set_; }
  const Predictions& predicted() const { return *predicted_; }
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
  IdentityMap identities_;
  const Predictions* predicted_ = nullptr;
  const Matches* matches_ = nullptr;
  const Markers* markers_ = nullptr;
  const TrackedMarkers* tracked_ = nullptr;
};

}  // namespace mocap::eval
