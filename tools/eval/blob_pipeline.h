#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "fusion/fusion.h"
#include "model/blob.h"
#include "model/search_report.h"
#include "model/sighting.h"
#include "model/snapshot.h"
#include "module/blob_tracker.h"
#include "settings/daemon_settings.h"
#include "synchronise/frame_aligner.h"

namespace mocap::eval {

/// The daemon's pipeline from the blobs of all cameras to snapshots, with 2D tracking for each camera, in the caller's
/// thread. The same blobs give the same snapshots.
class BlobPipeline {
 public:
  /// The settings outlive this object.
  explicit BlobPipeline(const settings::DaemonSettings& settings);

  /// Processes the blobs of one instant: one frame of each camera. The snapshot is valid until the next call.
  const Snapshot& step(const std::vector<BlobFrame>& frames);

  /// The set of the last step. Valid until the next step.
  const FrameSet& set() const noexcept { return set_; }

  /// Evidence of the search for a missing subject in the last step, if it was due.
  const SearchReport* search() const noexcept { return fusion_->search(); }

  /// The fit of a subject that the last step made and its snapshot uses, if any.
  const std::optional<SubjectFit>& fit() const noexcept { return fusion_->fit(); }

 private:
  std::vector<std::unique_ptr<BlobTracker>> blob_trackers_;  // by camera
  BlobFrame frame_;
  synchronise::AlignSettings align_;
  synchronise::FrameAligner aligner_;
  FrameSet set_;
  std::unique_ptr<fusion::Fusion> fusion_;
};

}  // namespace mocap::eval
