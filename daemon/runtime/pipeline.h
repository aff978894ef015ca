#pragma once

#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "fusion/fusion.h"
#include "model/description.h"
#include "module/blob_writer.h"
#include "module/control_server.h"
#include "module/publisher.h"
#include "module/writer.h"
#include "runtime/blob_recorder.h"
#include "runtime/camera_worker.h"
#include "runtime/control_channel.h"
#include "runtime/control_worker.h"
#include "runtime/fusion_worker.h"
#include "runtime/publish_worker.h"
#include "runtime/runtime_settings.h"
#include "runtime/side_worker.h"
#include "synchronise/frame_aligner.h"

namespace mocap::runtime {

struct PipelineParts {
  std::vector<CameraParts> cameras;  ///< by CameraId
  std::unique_ptr<fusion::Fusion> fusion;
  std::unique_ptr<Publisher> publisher;
  std::vector<std::unique_ptr<Writer>> writers;  ///< none: no side thread
  std::unique_ptr<BlobWriter> blob_writer;       ///< none: blobs are not recorded
  Description description;
  std::unique_ptr<ControlServer> control;  ///< none: nobody is listened to
};

/// All threads and the queues between them. They run from the constructor to `stop`.
class Pipeline {
 public:
  Pipeline(PipelineSettings settings, PipelineParts parts);
  ~Pipeline();
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;

  /// Whether a finite run is through: every camera at its end, all sent and written.
  bool finished() const noexcept { return publish_ended_.load(std::memory_order_acquire); }

  /// Whether every thread went round its loop, and sets came while images did, since the last call. Feeds the watchdog.
  bool progressed();

  /// Ends all threads and waits for them: the last snapshots are sent and written. Harmless when already stopped.
  void stop();

  /// What operators ask of the daemon as a whole, for the thread that owns the pipeline: take it, and answer.
  std::optional<MainOrder> take_order();
  void answer(MainDone answer);

  const FusionCounters& fusion_counters() const noexcept { return fusion_counters_; }
  const PublishCounters& publish_counters() const noexcept { return publish_counters_; }
  const SideCounters& side_counters() const noexcept { return side_counters_; }
  const CameraCounters& camera_counters(CameraId camera) const { return channels_[camera.value]->counters; }
  const RigGauges& rig_gauges(CameraId camera) const { return channels_[camera.value]->rig; }
  std::size_t camera_count() const noexcept { return channels_.size(); }

 private:
  struct Progress {
    std::uint64_t frames = 0, fusion_beats = 0, sets = 0, publish_beats = 0, side_beats = 0;
  };
  Progress progress() const;
  std::vector<CameraChannel*> borrow_channels();
  void start_threads();

  WakeSignal wake_fusion_;
  WakeSignal wake_recorder_;
  std::vector<std::unique_ptr<CameraChannel>> channels_;
  SnapshotChannel to_publish_;
  SnapshotChannel to_side_;
  std::unique_ptr<ControlChannel> control_;  // none: nobody is listened to
  FusionCounters fusion_counters_;
  PublishCounters publish_counters_;
  SideCounters side_counters_;
  std::vector<std::unique_ptr<CameraWorker>> camera_workers_;
  std::unique_ptr<FusionWorker> fusion_worker_;
  std::unique_ptr<PublishWorker> publish_worker_;
  std::unique_ptr<SideWorker> side_worker_;
  std::unique_ptr<ControlWorker> control_worker_;
  std::unique_ptr<BlobRecorder> blob_recorder_;
  std::atomic<bool> publish_ended_{false};
  Progress last_progress_;

  std::vector<std::jthread> camera_threads_;
  std::jthread fusion_thread_;
  std::jthread publish_thread_;
  std::jthread side_thread_;
  std::jthread control_thread_;
  std::jthread record_thread_;
};

}  // namespace mocap::runtime
