#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "base/bounded_vector.h"
#include "base/spsc_queue.h"
#include "base/wake_signal.h"
#include "detect/mask_learner.h"
#include "model/blob.h"
#include "model/health.h"
#include "module/blob_tracker.h"
#include "module/camera.h"
#include "module/detector.h"
#include "module/stream_counters.h"
#include "runtime/control_channel.h"
#include "runtime/counters.h"
#include "runtime/realtime.h"
#include "runtime/runtime_settings.h"
#include "synchronise/exposure_watch.h"

namespace mocap::runtime {

/// Makes the detector for images like this one (format and size).
using DetectorMaker = std::function<Result<std::unique_ptr<Detector>>(const Image& like)>;

/// What one camera's thread works with.
struct CameraParts {
  std::string name;
  std::unique_ptr<StreamCounters> stream;  ///< written by the camera, so it outlives it
  std::unique_ptr<Camera> camera;
  DetectorMaker make_detector;
  std::unique_ptr<BlobTracker> tracker;
  int expected_width_px = 0;  ///< the rig's; 0: any
  int expected_height_px = 0;
  std::vector<MaskPolygon> drawn_masks = {};  ///< that a learnt mask leaves out
};

/// A change of a camera's state, for the health report.
struct CameraNote {
  CameraPhase phase = CameraPhase::Starting;
  BoundedVector<char, 255> error;  ///< empty when all is well
};

enum class Delivery { NotYet, Delivering, Ended };

/// The way from one camera's thread to the others.
struct CameraChannel {
  CameraChannel(std::size_t queue_frames, WakeSignal& fusion) : frames(queue_frames), wake_fusion(fusion) {}

  SpscQueue<BlobFrame> frames;                       ///< to the fusion thread
  SpscQueue<CameraNote> notes{16};                   ///< to the publish thread; a note that finds no room is left out
  SpscQueue<CameraOrder> orders{4};                  ///< from the control thread
  SpscQueue<OrderDone> orders_done{4};               ///< to the control thread
  SpscQueue<MaskLearnt> masks{2};                    ///< to the control thread
  SpscQueue<synchronise::CameraTiming> timings{4};   ///< fusion thread to publish thread, about one a second
  std::unique_ptr<SpscQueue<BlobFrame>> to_record;   ///< to the blob recorder; null: blobs are not recorded
  std::atomic<Delivery> delivery{Delivery::NotYet};  ///< set by the camera's thread, after the frames it speaks of
  WakeSignal room;                                   ///< signalled by the fusion thread when it took frames
  WakeSignal& wake_fusion;
  WakeSignal record_room;               ///< signalled by the blob recorder when it took frames
  WakeSignal* wake_recorder = nullptr;  ///< where there is one
  RigGauges rig;                        ///< set by the fusion thread
  CameraCounters counters;
};

/// One camera's thread: image, blobs, 2D tracks, queue. A camera that fails or falls silent is opened anew, with
/// backoff; the other cameras do not notice.
class CameraWorker {
 public:
  /// The channel outlives the worker.
  CameraWorker(CameraParts parts, CameraWorkerSettings settings, CameraChannel& channel);

  /// The loop; returns when stopped, or when a finite source is through.
  void run(const std::stop_token& stop);

 private:
  Status stream(const std::stop_token& stop);
  Status start_camera(const std::stop_token& stop);
  Status take_in(const Frame& frame, const std::stop_token& stop);
  Status prepare_for(const Image& image);
  void push(const std::stop_token& stop);
  void record(const std::stop_token& stop);
  void tell_failure(const std::string& reason);
  void note(CameraPhase phase, const std::string& error = {});
  void deliver(Delivery state);
  void follow_orders();
  void follow(const CameraOrder& order);
  Status adjust(const CameraOrder& order);
  void learn_mask(const Image& image, double threshold_grey);
  void wait_until_started(const std::stop_token& stop);
  void wait_before_retry(Duration span, const std::stop_token& stop);

  CameraParts parts_;
  CameraWorkerSettings settings_;
  CameraChannel& channel_;
  std::unique_ptr<Detector> detector_;
  Image detector_made_for_;  // its pixels are never looked at
  BlobFrame seen_;           // scratch of take_in
  std::uint64_t next_number_ = 0;
  bool streaming_ = false;   // since the last start, an image has come
  bool silent_ = false;      // the last stream ended because no image came
  std::string told_reason_;  // of the last failure that the log has; empty since it streams
  Timestamp told_at_;
  WakeSignal nap_;
  bool stopped_ = false;                        // by an operator
  std::optional<CameraOrder> mask_order_;       // that is worked off
  std::optional<detect::MaskLearner> learner_;  // of that order, since the first image
};

}  // namespace mocap::runtime
