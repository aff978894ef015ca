#pragma once

#include <memory>
#include <stop_token>
#include <utility>
#include <vector>

#include "base/spsc_queue.h"
#include "base/wake_signal.h"
#include "model/preview.h"
#include "module/preview_encoder.h"
#include "runtime/camera/camera_worker.h"

namespace mocap::runtime {

/// From the preview thread to the publish thread.
struct PreviewChannel {
  SpscQueue<Preview> previews{8};  ///< a preview is dropped if the queue is full
  WakeSignal there_is_work;        ///< signalled by the threads of the cameras
};

/// The preview thread: compresses the previews of the cameras, for the publish thread. A slow one delays previews
/// alone.
class PreviewWorker {
 public:
  /// The channels outlive the worker.
  PreviewWorker(std::unique_ptr<PreviewEncoder> encoder, std::vector<CameraChannel*> cameras, PreviewChannel& channel)
      : encoder_(std::move(encoder)), cameras_(std::move(cameras)), channel_(channel) {}

  /// The loop; returns when stopped.
  void run(const std::stop_token& stop);

  /// Continues with other cameras. Call while no thread is in `run`.
  void change(std::vector<CameraChannel*> cameras) { cameras_ = std::move(cameras); }

 private:
  bool encode_waiting();

  std::unique_ptr<PreviewEncoder> encoder_;
  std::vector<CameraChannel*> cameras_;
  PreviewChannel& channel_;
  Preview preview_;  // scratch
};

}  // namespace mocap::runtime
