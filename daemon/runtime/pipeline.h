#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "fusion/fusion.h"
#include "model/description.h"
#include "model/handover.h"
#include "module/audit_trail.h"
#include "module/blob_writer.h"
#include "module/control_server.h"
#include "module/node_server.h"
#include "module/preview_encoder.h"
#include "module/ptp_clock.h"
#include "module/publisher.h"
#include "module/search_explainer.h"
#include "module/take_recorder.h"
#include "module/timecode_source.h"
#include "module/writer.h"
#include "runtime/blob_recorder.h"
#include "runtime/calibration_worker.h"
#include "runtime/camera/camera_worker.h"
#include "runtime/control/control_channel.h"
#include "runtime/control/control_worker.h"
#include "runtime/explain_worker.h"
#include "runtime/fusion_worker.h"
#include "runtime/node_worker.h"
#include "runtime/preview_worker.h"
#include "runtime/publish_worker.h"
#include "runtime/runtime_settings.h"
#include "runtime/side_worker.h"
#include "runtime/take_worker.h"
#include "runtime/timecode_worker.h"
#include "runtime/trigger_worker.h"
#include "synchronise/frame_aligner.h"

namespace mocap::runtime {

struct PipelineParts {
  std::vector<CameraParts> cameras;  ///< by CameraId
  std::unique_ptr<fusion::Fusion> fusion;
  std::unique_ptr<Publisher> publisher;
  std::vector<std::unique_ptr<Writer>> writers;  ///< none: no side thread
  std::unique_ptr<BlobWriter> blob_writer;       ///< none: blobs are not recorded
  Description description;
  std::unique_ptr<ControlServer> control;                ///< none: no requests are received
  std::unique_ptr<SearchExplainer> explainer = {};       ///< none: health has no reasons for missing subjects
  std::unique_ptr<TakeRecorder> takes = {};              ///< none: no takes are recorded
  std::unique_ptr<TriggerParts> trigger = {};            ///< none: takes have no remote triggers
  std::unique_ptr<TimecodeSource> timecode = {};         ///< none: snapshots have no timecode
  std::unique_ptr<PreviewEncoder> preview_encoder = {};  ///< none: no previews are made
  std::unique_ptr<NodeServer> node = {};                 ///< none: this daemon is no node; continues in a change
  PtpClock* ptp = nullptr;                               ///< outlives the pipeline; null: no clock of a node needs it
  std::unique_ptr<RigCalibrator> calibrator = {};        ///< none: nothing is calibrated
  AuditTrail* audit = nullptr;                           ///< outlives the pipeline; null: nothing is noted
};

/// How a camera continues in the next configuration.
enum class CameraStep {
  Continue,  ///< as it is: nothing that concerns the camera changed
  Refresh,   ///< with other parts of its thread, detector or masks; the device goes on
  Replace,   ///< the device is closed, and another one is opened
};

struct CameraChange {
  CameraStep step = CameraStep::Replace;
  CameraParts parts;  ///< Continue: none. Refresh: without camera and counters, and with a tracker if that is replaced
};

/// Opens a part that needs a port which the part before may occupy; called after that one was closed. An empty
/// function: the part before continues.
template <class Part>
using OpenPart = std::function<Result<std::unique_ptr<Part>>()>;

/// The next configuration of a running pipeline.
struct PipelineChange {
  PipelineSettings settings;          ///< `lossless` as before
  std::vector<CameraChange> cameras;  ///< by new CameraId
  std::unique_ptr<fusion::Fusion> fusion;
  Handover handover;
  /// As configured. The session continues, and so do the bodies of the subjects that the handover names.
  Description description;
  std::unique_ptr<SearchExplainer> explainer = {};  ///< null: health has no reasons for missing subjects
  OpenPart<Publisher> open_publisher;
  OpenPart<ControlServer> open_control;           ///< may return null: no requests are received
  std::vector<std::unique_ptr<Writer>> writers;   ///< beside the recordings that continue
  bool snapshots_continue = false;                ///< recordings of snapshots go on in the same files
  std::unique_ptr<BlobWriter> blob_writer;        ///< null: blobs are not recorded, or blobs_continue
  bool blobs_continue = false;                    ///< only with the same cameras
  std::unique_ptr<TakeRecorder> takes = {};       ///< null: no takes are recorded, or takes_continue
  bool takes_continue = false;                    ///< with the same recorder
  std::vector<TakeFile> take_files = {};          ///< of takes that start later, if takes_continue
  std::unique_ptr<TimecodeSource> timecode = {};  ///< null: snapshots have no timecode, or timecode_continues
  bool timecode_continues = false;
  PtpClock* ptp = nullptr;                         ///< as PipelineParts::ptp: the same object in all changes
  std::unique_ptr<RigCalibrator> calibrator = {};  ///< null: nothing is calibrated
  OpenPart<TriggerParts> open_trigger = {};        ///< may return null: takes have no remote triggers
};

/// All threads and the queues between them. The threads run from the constructor to `stop`. The main thread owns it.
class Pipeline {
  // A calibration that a change has ended, and whose thread is still in a step of the solution. Nobody waits for it.
  struct EndedCalibration {
    std::unique_ptr<CalibrationChannel> channel;
    std::unique_ptr<CalibrationWorker> worker;
    std::jthread thread;  // last: ends before the rest is destroyed
  };

 public:
  Pipeline(PipelineSettings settings, PipelineParts parts);
  ~Pipeline();
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;

  /// Changes to another configuration without losing anybody (runtime, decision 0008): cameras and recordings that
  /// continue go on meanwhile, the threads from fusion to files pause between two sets, and the new fusion adopts the
  /// belief of the old one. Subscribers stay connected, and receive the new description before the first snapshot that
  /// needs it. Fails if a part cannot be opened; then the pipeline must be stopped.
  Status change(PipelineChange change);

  /// Returns whether a finite run has ended: every camera ended, every snapshot was sent, and the hosts of a node have
  /// every image.
  bool finished() const noexcept {
    return publish_ended_.load(std::memory_order_acquire) && (!node_worker_ || node_worker_->ended());
  }

  /// Returns whether, since the last call, the fusion, publish and side threads iterated their loops and images led to
  /// frame sets. For the watchdog.
  bool progressed();

  /// Stops all threads and waits for them; the last snapshots are sent and written. Does nothing if already stopped.
  void stop();

  /// Returns the next order for the main thread, if any. Each order needs a call of `answer`.
  std::optional<MainOrder> take_order();
  void answer(MainDone answer);

  const FusionCounters& fusion_counters() const noexcept { return fusion_counters_; }
  const PublishCounters& publish_counters() const noexcept { return publish_counters_; }
  const SideCounters& side_counters() const noexcept { return side_counters_; }
  const CameraCounters& camera_counters(CameraId camera) const { return cameras_[camera.value].channel->counters; }
  const RigGauges& rig_gauges(CameraId camera) const { return cameras_[camera.value].channel->rig; }
  BlobUse blob_use(CameraId camera) const { return cameras_[camera.value].channel->blob_use.read(); }
  const std::string& camera_name(CameraId camera) const { return description_.cameras[camera.value].name; }
  /// The files that the pipeline writes; they live until the next `change`.
  std::vector<const RecordingProgress*> recordings() const;
  /// Whether recordings of snapshots, or of blobs, are in progress and none has failed.
  bool records_snapshots() const;
  bool records_blobs() const;
  std::size_t camera_count() const noexcept { return cameras_.size(); }

 private:
  struct Progress {
    std::uint64_t frames = 0, fusion_beats = 0, sets = 0, publish_beats = 0, side_beats = 0;
  };
  // A camera's thread, the last member, ends before its worker.
  struct CameraUnit {
    std::unique_ptr<CameraChannel> channel;
    std::unique_ptr<CameraWorker> worker;
    std::jthread thread;
  };

  static PipelineSettings with_lossless(PipelineSettings settings);
  Progress progress() const;
  std::vector<CameraChannel*> borrow_channels() const;
  std::vector<const StreamCounters*> borrow_streams() const;
  CameraWorkerSettings camera_settings(std::size_t camera) const;
  std::unique_ptr<CameraChannel> make_channel();
  std::size_t side_queue() const { return std::max<std::size_t>(settings_.side_queue_snapshots, 1); }
  FusionWorker::Links fusion_links();
  PublishWorker::Links publish_links();
  ControlWorker::Links control_links();
  Description describe_next(const PipelineChange& change) const;

  void pause_control();
  void change_cameras(PipelineChange& change);
  void refresh_camera(std::size_t camera, CameraChange& change);
  void replace_camera(std::size_t camera, PipelineChange& change);
  void set_recording(CameraChannel& channel);
  void set_explainer(std::unique_ptr<SearchExplainer> explainer);
  void pause_explain();
  void start_previews();
  void start_node();
  void pause_node();
  void set_calibrator(std::unique_ptr<RigCalibrator> calibrator);
  void start_calibration();
  void stop_calibration();
  void pause_previews();
  std::unique_ptr<BlobRecorder> pause_recorder(PipelineChange& change);
  void pause_row();
  void change_row(PipelineChange& change);
  void change_side(PipelineChange& change);
  void close_ports(const PipelineChange& change);
  Status open_publisher(const OpenPart<Publisher>& open);
  Status open_control(const OpenPart<ControlServer>& open);
  Status open_trigger(const OpenPart<TriggerParts>& open);

  void start_camera(std::size_t camera);
  void start_side();
  void start_recorder();
  void start_explain();
  void start_takes();
  void stop_take_intake();
  void stop_take_disk();
  void set_takes(std::unique_ptr<TakeRecorder> recorder);
  void set_trigger(std::unique_ptr<TriggerParts> parts);
  void start_trigger();
  void stop_trigger();
  void change_takes(PipelineChange& change);
  void start_timecode(std::unique_ptr<TimecodeSource> source);
  void stop_timecode();
  void set_ptp(PtpClock* clock);
  void start_publish();
  void start_fusion();
  void start_control();

  PipelineSettings settings_;
  AuditTrail* audit_;
  Description description_;  // of the configuration, with the bodies that were in force at its start
  bool records_blobs_ = false;
  WakeSignal wake_fusion_;
  WakeSignal wake_recorder_;
  bool records_takes_ = false;
  WakeSignal wake_take_;
  TakeChannel take_channel_;
  TimecodeChannel timecode_channel_;
  PreviewChannel preview_channel_;
  std::unique_ptr<SnapshotChannel> to_takes_;   // null: no takes are recorded
  std::unique_ptr<SpscQueue<Belief>> beliefs_;  // with to_takes_
  std::unique_ptr<SnapshotChannel> to_publish_;
  std::unique_ptr<SnapshotChannel> to_side_;  // null: nothing was written yet
  std::unique_ptr<ControlChannel> control_;   // null: no requests are received
  std::unique_ptr<SearchChannel> search_;     // null: no reasons for missing subjects
  FusionCounters fusion_counters_;
  PublishCounters publish_counters_;
  SideCounters side_counters_;
  std::unique_ptr<FusionWorker> fusion_worker_;
  std::unique_ptr<PublishWorker> publish_worker_;
  std::unique_ptr<SideWorker> side_worker_;
  std::unique_ptr<ControlWorker> control_worker_;
  std::unique_ptr<BlobRecorder> blob_recorder_;
  std::unique_ptr<ExplainWorker> explain_worker_;
  std::unique_ptr<TakeWorker> take_worker_;
  std::unique_ptr<TriggerWorker> trigger_worker_;
  std::unique_ptr<TimecodeWorker> timecode_worker_;  // null: no source of timecode
  std::unique_ptr<CalibrationChannel> calibration_;  // null: nothing is calibrated
  std::unique_ptr<CalibrationWorker> calibration_worker_;
  std::vector<EndedCalibration> ended_calibrations_;
  std::unique_ptr<PreviewWorker> preview_worker_;       // null: no previews are made
  std::unique_ptr<NodeWorker> node_worker_;             // null: this daemon is no node
  std::vector<std::unique_ptr<SideFile>> ended_files_;  // to be finished
  std::unique_ptr<TakeWorker> ended_takes_;             // to be finished
  std::vector<CameraUnit> cameras_;                     // by CameraId
  std::vector<CameraUnit> removed_;                     // stopped; other threads may still use the channels
  std::atomic<bool> publish_ended_{false};
  Progress last_progress_;

  std::jthread fusion_thread_;
  std::jthread publish_thread_;
  std::jthread side_thread_;
  std::jthread control_thread_;
  std::jthread record_thread_;
  std::jthread explain_thread_;
  std::jthread take_intake_thread_;
  std::jthread take_disk_thread_;
  std::jthread trigger_thread_;
  std::jthread timecode_thread_;
  std::jthread ptp_thread_;
  std::jthread preview_thread_;
  std::jthread node_thread_;
  std::jthread calibration_thread_;
};

}  // namespace mocap::runtime
