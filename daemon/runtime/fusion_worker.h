#pragma once

#include <memory>
#include <optional>
#include <stop_token>
#include <vector>

#include "base/spsc_queue.h"
#include "base/wake_signal.h"
#include "fusion/fusion.h"
#include "model/clock/timecode_health.h"
#include "model/search_health.h"
#include "model/search_report.h"
#include "model/snapshot.h"
#include "model/take/belief.h"
#include "runtime/camera/camera_worker.h"
#include "runtime/marker_channel.h"
#include "runtime/pausable.h"
#include "runtime/process/realtime.h"
#include "runtime/report/counters.h"
#include "runtime/runtime_settings.h"
#include "synchronise/frame_aligner.h"

namespace mocap::runtime {

/// Queues from the fusion thread to a thread that consumes snapshots.
struct SnapshotChannel {
  explicit SnapshotChannel(std::size_t queue_snapshots) : snapshots(queue_snapshots) {}

  SpscQueue<Snapshot> snapshots;
  SpscQueue<SubjectFit> fits{kMaxSubjects};  ///< pushed before the first snapshot that uses them
  std::atomic<bool> ended{false};            ///< set after the last snapshot
  WakeSignal there_is_work;                  ///< signalled by the fusion thread
  WakeSignal room;                           ///< signalled by the consumer when it removed a snapshot
};

/// Queues of the reports of missing subjects: fusion thread to explain thread, and the reasons from there to the
/// publish thread. A full queue drops a report; the next one comes a second later.
struct SearchChannel {
  SpscQueue<SearchReport> reports{kMaxSubjects};
  SpscQueue<SearchHealth> reasons{kMaxSubjects};
  WakeSignal there_is_work;  ///< signalled by the fusion thread
};

/// Queues from the timecode thread, which sends up to 100 items a second. A full queue drops an item; the next one
/// comes within 50 ms.
struct TimecodeChannel {
  SpscQueue<std::optional<TimecodeClock>> to_fusion{4};  ///< empty: there is no timecode
  SpscQueue<TimecodeHealth> to_publish{16};
  SpscQueue<TimecodeHealth> to_takes{16};
};

/// The fusion thread: groups the blobs of all cameras into frame sets, fuses each set and pushes the snapshot to the
/// publish thread and the side thread.
class FusionWorker : public Pausable {
 public:
  /// The channels and `wake` outlive the worker. `side` may be null.
  struct Links {
    std::vector<CameraChannel*> cameras;  ///< by CameraId
    SnapshotChannel* publish = nullptr;
    SnapshotChannel* side = nullptr;
    SnapshotChannel* takes = nullptr;      ///< may be null: no takes are recorded
    SpscQueue<Belief>* beliefs = nullptr;  ///< for takes, about one a second; may be null
    WakeSignal* wake = nullptr;            ///< signalled by the camera threads and the control thread
    ControlChannel* control = nullptr;     ///< may be null
    SearchChannel* search = nullptr;       ///< may be null: reports of searches are dropped
    TimecodeChannel* timecode = nullptr;   ///< may be null: snapshots have no timecode
    MarkerChannel* markers = nullptr;      ///< may be null: nothing is calibrated
  };

  FusionWorker(synchronise::AlignSettings align, std::unique_ptr<fusion::Fusion> fusion, FusionWorkerSettings settings,
               Links links, FusionCounters& counters);

  /// A fusion of another configuration.
  struct Change {
    synchronise::AlignSettings align;
    std::unique_ptr<fusion::Fusion> fusion;
    Handover handover;
    FusionWorkerSettings settings;
    Links links;
  };

  /// The loop; returns when stopped, or, if lossless, when all cameras have ended and every snapshot was pushed. If
  /// paused, the snapshot channels do not end.
  void run(const std::stop_token& stop);

  /// Continues with another fusion, which adopts the belief of this one. The sets are numbered on. Frames that wait for
  /// their set are lost only if the number of cameras or the alignment changes. Call while no thread is in `run`.
  void change(Change change);

  const fusion::Fusion& fusion() const noexcept { return *fusion_; }

 private:
  bool gather();
  bool follow_delivery(std::size_t camera);
  bool fuse_ready_sets(const std::stop_token& stop);
  void fuse(const FrameSet& frames, const std::stop_token& stop);
  void send_markers(const Snapshot& snapshot);
  void send_belief(const Snapshot& snapshot);
  bool push(const Snapshot& snapshot, SnapshotChannel& to, const std::stop_token& stop);
  void follow_orders();
  void follow_timecode();
  void send_timing();
  void update_rig_gauges();
  void count_blobs();
  bool all_ended() const;
  void expect_delivering_cameras();
  Timestamp now() const;

  synchronise::AlignSettings align_;
  synchronise::FrameAligner aligner_;
  std::unique_ptr<fusion::Fusion> fusion_;
  FusionWorkerSettings settings_;
  Links links_;
  FusionCounters& counters_;
  std::vector<Delivery> delivery_;  // by camera, as known to the aligner
  Timestamp timing_sent_at_;
  Timestamp belief_sent_at_;  // exposure of its set
  std::optional<TimecodeClock> timecode_;
};

}  // namespace mocap::runtime
