#pragma once

#include <memory>
#include <stop_token>
#include <vector>

#include "base/spsc_queue.h"
#include "base/wake_signal.h"
#include "fusion/fusion.h"
#include "model/snapshot.h"
#include "runtime/camera_worker.h"
#include "runtime/counters.h"
#include "runtime/realtime.h"
#include "runtime/runtime_settings.h"
#include "synchronise/frame_aligner.h"

namespace mocap::runtime {

/// The way from the fusion thread to one that takes snapshots.
struct SnapshotChannel {
  explicit SnapshotChannel(std::size_t queue_snapshots) : snapshots(queue_snapshots) {}

  SpscQueue<Snapshot> snapshots;
  SpscQueue<SubjectFit> fits{kMaxSubjects};  ///< pushed before the first snapshot that uses them
  std::atomic<bool> ended{false};            ///< set after the last snapshot
  WakeSignal there_is_work;                  ///< signalled by the fusion thread
  WakeSignal room;                           ///< signalled by the consumer when it took a snapshot
};

/// The fusion thread: gathers the cameras' blobs into sets, runs the row on each, hands the snapshots on.
class FusionWorker {
 public:
  /// The channels and `wake` outlive the worker. `side` may be null.
  struct Links {
    std::vector<CameraChannel*> cameras;  ///< by CameraId
    SnapshotChannel* publish = nullptr;
    SnapshotChannel* side = nullptr;
    WakeSignal* wake = nullptr;         ///< the cameras signal it
    ControlChannel* control = nullptr;  ///< may be null
  };

  FusionWorker(synchronise::AlignSettings align, std::unique_ptr<fusion::Fusion> fusion, FusionWorkerSettings settings,
               Links links, FusionCounters& counters);

  /// The loop; returns when stopped, or when all cameras have ended and (lossless only) all is handed on.
  void run(const std::stop_token& stop);

 private:
  bool gather();
  bool follow_delivery(std::size_t camera);
  bool fuse_what_is_ready(const std::stop_token& stop);
  void fuse(const FrameSet& frames, const std::stop_token& stop);
  bool hand_on(const Snapshot& snapshot, SnapshotChannel& to, const std::stop_token& stop);
  void follow_orders();
  void tell_timing();
  void tell_rig();
  bool all_ended() const;
  Timestamp now() const;

  synchronise::FrameAligner aligner_;
  std::unique_ptr<fusion::Fusion> fusion_;
  FusionWorkerSettings settings_;
  Links links_;
  FusionCounters& counters_;
  std::vector<Delivery> delivery_;  // as last told to the aligner
  Timestamp timing_told_at_;
};

}  // namespace mocap::runtime
