#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cameras/clock/exposure_clock.h"
#include "chaos/faulty_cameras.h"
#include "fusion/fusion.h"
#include "model/handover.h"
#include "module/blob_tracker.h"
#include "settings/daemon_settings.h"
#include "synchronise/frame_aligner.h"

namespace mocap::chaos {

/// Counts of the images of all cameras, and of the sets that were not fused.
struct FrameCounts {
  std::uint64_t received = 0;
  std::uint64_t used = 0;         ///< images in the sets that the aligner returned, fused or not
  std::uint64_t dropped = 0;      ///< late, repeated, over the bound of a queue, or lost with their camera
  std::uint64_t waiting = 0;      ///< in the queues of the cameras, ahead of the aligner
  std::uint64_t passed_over = 0;  ///< sets that were superseded and not fused
};

/// The daemon's steps from images to snapshots in one thread, under a virtual clock: clock of each camera, 2D tracks,
/// queues, alignment and fusion, in the order of CameraWorker and FusionWorker.
class StepDaemon {
 public:
  /// Receives what the steps make. `frame`: with its 2D tracks, before the queue. `set`: the snapshot is borrowed.
  struct Outputs {
    std::function<void(const BlobFrame& frame)> frame;
    std::function<void(Snapshot& snapshot, const std::optional<SubjectFit>& fit, Timestamp now)> set;
  };

  /// `clock`: as AravisSettings::clock.
  StepDaemon(settings::DaemonSettings settings, const std::string& clock, Outputs outputs);

  /// One image of a camera, at its arrival or later.
  void receive(const Arrival& arrival, Timestamp now);
  /// The link of a camera is down: its device is lost.
  void lose(CameraId camera);
  /// Fuses the sets that are ready, and follows the silence of cameras.
  void work(Timestamp now);
  /// When `work` has something to do without a new image; nothing if no image waits.
  std::optional<Timestamp> due() const { return aligner_.patience_ends(); }

  /// Continues with other settings, as FusionWorker::change.
  void reload(settings::DaemonSettings settings, const Handover& handover);

  /// Fuses the images that still wait. The last call.
  void finish(Timestamp now);

  FrameCounts counts() const;
  const settings::DaemonSettings& settings() const { return *settings_; }
  const fusion::Fusion& fusion() const { return *fusion_; }
  /// The orders of an operator, as FusionWorker::follow_orders.
  void reset(SubjectId subject) { fusion_->reset(subject); }
  void set_away(SubjectId subject, bool away) { fusion_->set_away(subject, away); }
  /// Growth of the heap in all calls of Fusion::step after the first second.
  std::int64_t step_growth_bytes() const { return step_growth_bytes_; }

 private:
  struct CameraSide {
    std::unique_ptr<cameras::ExposureClock> clock;
    std::unique_ptr<BlobTracker> tracker;
    std::deque<BlobFrame> queue;
    std::optional<Timestamp> heard_at;  // empty: ended, or not yet delivering
    bool expected = false;              // as known to the aligner
  };

  bool gather();
  bool fuse_ready_sets(Timestamp now);
  void fuse(const FrameSet& set, Timestamp now);
  void end(CameraSide& camera, CameraId id);
  std::uint64_t in_aligner() const;

  std::unique_ptr<settings::DaemonSettings> settings_;
  Outputs outputs_;
  std::vector<CameraSide> cameras_;
  synchronise::FrameAligner aligner_;
  std::unique_ptr<fusion::Fusion> fusion_;
  FrameCounts counts_;
  Timestamp assessed_at_;
  std::uint64_t steps_ = 0;
  std::int64_t step_growth_bytes_ = 0;
  BlobFrame frame_;
};

}  // namespace mocap::chaos
