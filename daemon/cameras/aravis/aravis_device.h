#pragma once

#include <atomic>
#include <memory>
#include <thread>
#include <utility>

#include "base/result.h"
#include "cameras/aravis/action_trigger.h"
#include "cameras/aravis/aravis_chunks.h"
#include "cameras/aravis/aravis_features.h"
#include "cameras/aravis/aravis_settings.h"

typedef struct _ArvStream ArvStream;  // NOLINT(bugprone-reserved-identifier): Aravis's own name, for pointers only

namespace mocap::cameras {

/// An open camera that this process controls, with settings applied and stream created; the acquisition is not started.
/// The destructor stops and closes the camera, which takes Aravis up to 12 s if the camera is lost. One thread at a
/// time makes calls, not always the same one: the camera is opened and closed on threads of its own. keeps_time() may
/// be called by any thread. After watch_ptp() a further thread reads features of the camera meanwhile.
class AravisDevice {
 public:
  /// Takes ownership of `camera` and `stream`.
  AravisDevice(ArvCamera* camera, ArvStream* stream, const AravisFeatures& features,
               std::unique_ptr<AravisChunks> chunks)
      : camera_(camera), stream_(stream), features_(features), chunks_(std::move(chunks)) {}
  ~AravisDevice();
  AravisDevice(const AravisDevice&) = delete;
  AravisDevice& operator=(const AravisDevice&) = delete;

  ArvCamera* camera() const { return camera_; }
  ArvStream* stream() const { return stream_; }
  const AravisFeatures& features() const { return features_; }

  /// Reader of the chunk data; null if the camera has none.
  AravisChunks* chunks() const { return chunks_.get(); }

  /// Sender of action commands; null unless trigger = "action".
  ActionTrigger* action_trigger() const { return action_trigger_.get(); }
  void be_triggered_by(std::unique_ptr<ActionTrigger> trigger) { action_trigger_ = std::move(trigger); }

  /// True once the camera has not answered for about 5 s.
  bool lost() const;
  bool on_usb() const;

  /// Starts a thread that reads the PTP state; the thread ends with this object.
  void watch_ptp();
  /// The last known PTP state: true if the camera keeps its master's time. True without watch_ptp(). Any thread.
  bool keeps_time() const { return keeps_time_; }

 private:
  ArvCamera* camera_;
  ArvStream* stream_;
  AravisFeatures features_;
  std::unique_ptr<AravisChunks> chunks_;
  std::unique_ptr<ActionTrigger> action_trigger_;
  std::atomic<bool> keeps_time_{true};
  std::jthread ptp_watch_;
};

/// Where a camera was found the last time.
enum class Seen { Never, OnNetwork, OnUsb };

/// Finds the camera that `settings` identify, opens it, applies the settings and creates the stream. A camera that was
/// found before is searched where it was: at its address, without a discovery of all cameras, or on the USB, where the
/// function waits 1.5 s for it.
///
/// Takes about 1 s for the discovery, and several seconds if the camera stops answering during the call: not for a
/// thread with a deadline. Fails with NotFound and a list of the cameras that were found, with Busy if another program
/// controls the camera, and as apply_settings() does.
Result<std::unique_ptr<AravisDevice>> open_aravis_device(const AravisSettings& settings, Seen seen);

}  // namespace mocap::cameras
