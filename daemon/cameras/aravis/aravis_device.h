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

/// A camera that is open, controlled by us and set; its stream is there and its acquisition not yet begun. Its end
/// stops and closes it, for which Aravis takes up to 12 s when the camera is gone. One thread at a time.
class AravisDevice {
 public:
  /// Takes both over.
  AravisDevice(ArvCamera* camera, ArvStream* stream, const AravisFeatures& features,
               std::unique_ptr<AravisChunks> chunks)
      : camera_(camera), stream_(stream), features_(features), chunks_(std::move(chunks)) {}
  ~AravisDevice();
  AravisDevice(const AravisDevice&) = delete;
  AravisDevice& operator=(const AravisDevice&) = delete;

  ArvCamera* camera() const { return camera_; }
  ArvStream* stream() const { return stream_; }
  const AravisFeatures& features() const { return features_; }

  /// What it writes behind its images; null where nothing.
  AravisChunks* chunks() const { return chunks_.get(); }

  /// What tells it when to expose; null where something else does.
  ActionTrigger* action_trigger() const { return action_trigger_.get(); }
  void be_triggered_by(std::unique_ptr<ActionTrigger> trigger) { action_trigger_ = std::move(trigger); }

  /// Whether the camera stopped answering; after some 5 s without an answer.
  bool lost() const;
  bool on_usb() const;

  /// From now on the state of its PTP clock is watched, on a thread that ends with the device.
  void watch_ptp();
  /// Whether it keeps its master's time, as it last said; true of one that is not watched. Any thread.
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

/// Whether a camera was there before, and where.
enum class Seen { Never, OnNetwork, OnUsb };

/// Looks for the camera that `settings` names, opens and sets it, and makes its stream. One that was seen before is
/// looked for where it was: at its address without asking who else is there, or on the USB, where it is waited for.
///
/// Takes a second for the looking and several when the camera falls silent meanwhile: for a thread that may wait. Fails
/// with NotFound and what was found instead, Busy when another program controls the camera, and as apply_settings does.
Result<std::unique_ptr<AravisDevice>> open_aravis_device(const AravisSettings& settings, Seen seen);

}  // namespace mocap::cameras
