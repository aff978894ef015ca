#pragma once

#include <memory>
#include <stop_token>
#include <vector>

#include "module/blob_writer.h"
#include "runtime/camera_worker.h"
#include "runtime/counters.h"

namespace mocap::runtime {

/// The blob recorder's thread: what the cameras' detectors find, to a file. A disk that is too slow costs pictures of
/// the file (counted by the camera threads), never of the feed.
class BlobRecorder {
 public:
  /// The channels outlive it; each has a record queue.
  BlobRecorder(std::unique_ptr<BlobWriter> writer, std::vector<CameraChannel*> cameras, WakeSignal& wake);

  /// The loop; returns when stopped and all that waits is written. To be stopped after the cameras.
  void run(const std::stop_token& stop);

 private:
  bool write_what_waits();

  std::unique_ptr<BlobWriter> writer_;
  std::vector<CameraChannel*> cameras_;
  WakeSignal& wake_;
  bool failed_ = false;
};

}  // namespace mocap::runtime
