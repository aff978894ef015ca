#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <vector>

#include "base/result.h"
#include "model/frame.h"
#include "runtime/camera_worker.h"
#include "settings/daemon_settings.h"

namespace mocap::calibrate {

enum class Wish { More, Enough };

/// What is done with each image of a camera, on that camera's own thread; the parts make its detector. An error ends
/// that camera's run.
using TakeImage = std::function<Result<Wish>(const Frame&, const runtime::CameraParts&)>;

/// One camera's run.
struct CameraRun {
  TakeImage take;
  std::atomic<std::size_t> images{0};  ///< so far; any thread may read
  std::atomic<bool> failed{false};     ///< it ended, and not well; any thread may read
  Status end;                          ///< why it ended; good when enough came or a recording is through
};

/// Runs all cameras of `settings` as the daemon does, at once (the light of one is seen by the others), until each has
/// enough; recordings as fast as they go. `runs` are by CameraId. `watch` is called about ten times a second on the
/// caller's thread; returning false ends it all.
void run_cameras(const settings::DaemonSettings& settings, std::vector<CameraRun>& runs,
                 const std::function<bool()>& watch);

}  // namespace mocap::calibrate
