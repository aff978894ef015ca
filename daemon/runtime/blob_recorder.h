#pragma once

#include <memory>
#include <stop_token>
#include <utility>
#include <vector>

#include "module/blob_writer.h"
#include "runtime/camera/camera_worker.h"
#include "runtime/pausable.h"
#include "runtime/report/counters.h"
#include "runtime/report/recording_progress.h"

namespace mocap::runtime {

/// The blob recorder's thread: writes the blobs of all cameras to a file. If the disk is too slow, images are missing
/// in the file (counted by the camera threads), never in the feed. The recording ends with its first failed write.
class BlobRecorder : public Pausable {
 public:
  /// The channels outlive the recorder; each has a `to_record` queue.
  BlobRecorder(std::unique_ptr<BlobWriter> writer, std::vector<CameraChannel*> cameras, WakeSignal& wake);

  /// The loop; returns when stopped and all waiting blobs are written. Stop the recorder after the camera threads. If
  /// paused, the file stays open.
  void run(const std::stop_token& stop);

  /// Continues with the channels of another configuration. Call while no thread is in `run`.
  void change(std::vector<CameraChannel*> cameras) { cameras_ = std::move(cameras); }

  const RecordingProgress& recording() const noexcept { return progress_; }

 private:
  bool write_waiting();

  std::unique_ptr<BlobWriter> writer_;
  std::vector<CameraChannel*> cameras_;
  WakeSignal& wake_;
  RecordingProgress progress_;
};

}  // namespace mocap::runtime
