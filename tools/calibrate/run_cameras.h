#pragma once

#include <atomic>
#include <cstddef>
#include <functional>
#include <vector>

#include "base/result.h"
#include "model/frame.h"
#include "runtime/camera/camera_worker.h"
#include "settings/daemon_settings.h"

namespace mocap::calibrate {

enum class RunState { Continue, Finished };

/// Handles one image of a camera, on the camera's own thread; the parts make its detector. An error ends the run of
/// that camera.
using ImageHandler = std::function<Result<RunState>(const Frame&, const runtime::CameraParts&)>;

/// The run of one camera.
struct CameraRun {
  ImageHandler handle;
  std::atomic<std::size_t> images{0};  ///< handled so far; any thread may read
  std::atomic<bool> failed{false};     ///< ended with an error; any thread may read
  Status end;                          ///< success if the handler finished or a replay ended
};

/// Runs all cameras of `settings` at once, as the daemon does (each sees the lights of the others), until every handler
/// has finished; replays at full speed. `runs`: by CameraId. Calls `watch` about ten times a second on the caller's
/// thread; if it returns false, all runs end.
void run_cameras(const settings::DaemonSettings& settings, std::vector<CameraRun>& runs,
                 const std::function<bool()>& watch);

}  // namespace mocap::calibrate
