#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "base/bounded_vector.h"
#include "base/result.h"
#include "base/spsc_queue.h"
#include "base/time.h"
#include "base/wake_descriptor.h"
#include "base/wake_signal.h"
#include "detect/mask_learner.h"
#include "model/blob.h"
#include "model/calibration/calibration_image.h"
#include "model/health.h"
#include "module/blob_tracker.h"
#include "module/camera.h"
#include "module/detector.h"
#include "module/stream_counters.h"
#include "runtime/camera/failure_fold.h"
#include "runtime/camera/preview_slot.h"
#include "runtime/control/control_channel.h"
#include "runtime/pausable.h"
#include "runtime/process/realtime.h"
#include "runtime/report/counters.h"
#include "runtime/runtime_settings.h"
#include "synchronise/exposure_watch.h"

namespace mocap::runtime {

/// Makes a detector for images of the format and size of `like`.
using DetectorMaker = std::function<Result<std::unique_ptr<Detector>>(const Image& like)>;

/// The parts of one camera's thread.
struct CameraParts {
  std::string name;
  std::unique_ptr<StreamCounters> stream;  ///< written by `camera`, which it outlives
  std::unique_ptr<Camera> camera;
  DetectorMaker make_detector;
  std::unique_ptr<BlobTracker> tracker;
  int expected_width_px = 0;  ///< size in the rig; 0: any size
  int expected_height_px = 0;
  std::vector<MaskPolygon> drawn_masks = {};  ///< configured masks; a learnt mask excludes their area
  /// The images are those of a recording, which would begin again if the camera were reopened: neither silence nor
  /// unusable images reopen it.
  bool recorded = false;
  FailureFold* failures = nullptr;  ///< of cameras that fail together; null: logs its own. It outlives the worker
};

/// A change of a camera's state, for the health report.
struct CameraNote {
  CameraPhase phase = CameraPhase::Starting;
  BoundedVector<char, 255> error;  ///< empty if there is none
};

enum class Delivery { NotYet, Delivering, Ended };

/// Images that wait for the calibration thread: 0.5 s at 120 Hz.
inline constexpr std::size_t kCalibrationImages = 64;

/// Queues and counters between one camera's thread and the other threads.
struct CameraChannel {
  CameraChannel(std::size_t queue_frames, WakeSignal& fusion) : frames(queue_frames), wake_fusion(fusion) {}

  SpscQueue<BlobFrame> frames;                       ///< to the fusion thread
  SpscQueue<CameraNote> notes{16};                   ///< to the publish thread; a note is dropped if the queue is full
  SpscQueue<CameraOrder> orders{4};                  ///< from the control thread
  SpscQueue<OrderDone> orders_done{4};               ///< to the control thread
  SpscQueue<MaskLearnt> masks{2};                    ///< to the control thread
  SpscQueue<synchronise::CameraTiming> timings{4};   ///< fusion thread to publish thread, about one a second
  std::unique_ptr<SpscQueue<BlobFrame>> to_record;   ///< to the blob recorder; unused without wake_recorder
  std::unique_ptr<SpscQueue<BlobFrame>> to_take;     ///< to the recorder of takes; unused without wake_take
  std::atomic<Delivery> delivery{Delivery::NotYet};  ///< set by the camera's thread, after its frames were pushed
  WakeSignal room;                                   ///< signalled by the fusion thread when it removed frames
  WakeSignal& wake_fusion;
  WakeSignal record_room;                         ///< signalled by the blob recorder when it removed frames
  WakeSignal* wake_recorder = nullptr;            ///< null: blobs are not recorded
  WakeSignal* wake_take = nullptr;                ///< null: no takes are recorded
  std::unique_ptr<SpscQueue<BlobFrame>> to_node;  ///< to the node thread; unused without wake_node
  WakeSignal node_room;                           ///< signalled by the node thread when it removed frames
  WakeDescriptor* wake_node = nullptr;            ///< null: this daemon is no node
  std::atomic<std::uint32_t> width_px{0};         ///< of the images, for the node thread; 0: none came yet
  std::atomic<std::uint32_t> height_px{0};
  PreviewSlot preview;                                           ///< to the preview thread
  SpscQueue<CalibrationImage> to_calibrate{kCalibrationImages};  ///< to the calibration thread, while `calibrating`
  std::atomic<bool> calibrating{false};                          ///< set by the calibration thread
  WakeSignal* wake_preview = nullptr;                            ///< null: no previews are made
  RigGauges rig;                                                 ///< set by the fusion thread
  BlobUseCounters blob_use;                                      ///< set by the fusion thread
  CameraCounters counters;
};

/// One camera's thread: receives images, detects blobs, tracks them in 2D and pushes them to the fusion thread. A
/// camera that fails or delivers no images is reopened with backoff; the other cameras are not affected.
class CameraWorker : public Pausable {
 public:
  /// The channel outlives the worker.
  CameraWorker(CameraParts parts, CameraWorkerSettings settings, CameraChannel& channel);

  /// The loop; returns when stopped, or at the end of a finite source. If paused, the camera goes on delivering.
  void run(const std::stop_token& stop);

  /// Uses other parts and settings from the next `run` on. The camera and its counters continue, and the 2D tracker
  /// does if `parts.tracker` is null. Call while no thread is in `run`.
  void change(CameraParts parts, CameraWorkerSettings settings);
  /// Whether an operator stopped the camera. Call while no thread is in `run`.
  bool stopped() const noexcept { return stopped_; }
  void set_stopped(bool stopped) noexcept { stopped_ = stopped; }
  /// Releases the camera; the worker only keeps the counters. Call while no thread is in `run`, which ends.
  void close_camera() noexcept { parts_.camera.reset(); }

  const StreamCounters& stream_counters() const noexcept { return *parts_.stream; }

 private:
  Status stream(const std::stop_token& stop);
  Status start_camera(const std::stop_token& stop);
  Status note_unusable(const Error& error, Timestamp now, Timestamp unusable_since);
  Status process(const Frame& frame, const std::stop_token& stop);
  Status prepare_for(const Image& image);
  void push(const std::stop_token& stop);
  void record(const std::stop_token& stop);
  void keep_for_take();
  void pass_to_node(const std::stop_token& stop);
  void offer_preview(const Frame& frame);
  void offer_calibration(const Image& image);
  CameraPhase phase_after(const Error& error) const;
  void log_failure(const Error& error);
  void log_silence();
  void log_lost(const std::string& reason, std::string_view others) const;
  void end_failure();
  void note(CameraPhase phase, const std::string& error = {});
  void deliver(Delivery state);
  void follow_orders();
  void follow(const CameraOrder& order);
  Status adjust(const CameraOrder& order);
  void learn_mask(const Image& image, double threshold_grey);
  void measure_brightest(const Frame& frame, bool is_blind);
  void wait_until_started(const std::stop_token& stop);
  void wait_before_retry(Duration span, const std::stop_token& stop);

  CameraParts parts_;
  CameraWorkerSettings settings_;
  CameraChannel& channel_;
  std::unique_ptr<Detector> detector_;
  Image detector_made_for_;  // only size and format are used
  BlobFrame seen_;           // scratch of process
  std::uint64_t next_number_ = 0;
  bool started_ = false;                       // the camera delivers: start() succeeded, stop() was not called
  bool streaming_ = false;                     // an image came since the last start
  bool silent_ = false;                        // the last stream ended because no image came
  bool silence_is_held_ = false;               // it is not logged yet
  CameraPhase phase_ = CameraPhase::Starting;  // of the last note
  Timestamp starting_at_;                      // begin of the last phase Starting
  std::string logged_reason_;                  // reason of the last logged failure; empty while the camera streams
  Timestamp logged_at_;
  FailureFold unusable_;                   // kinds of unusable images that were logged
  std::optional<Timestamp> brightest_at_;  // last measurement
  WakeSignal nap_;
  bool stopped_ = false;                        // by an operator
  std::optional<CameraOrder> mask_order_;       // LearnMask order in progress
  std::optional<detect::MaskLearner> learner_;  // set from the first image of this order on
};

}  // namespace mocap::runtime
