#pragma once

#include "base/result.h"
#include "base/time.h"
#include "model/ids.h"
#include "runtime/pipeline.h"
#include "settings/daemon_settings.h"

namespace mocap {

/// Constructs one camera with its detector and its 2D tracker; opens nothing. The settings outlive the camera. A
/// simulated camera that runs in real time starts its motion at `epoch`, unless its settings have an epoch.
Result<runtime::CameraParts> assemble_camera(const settings::DaemonSettings& settings, CameraId id, Timestamp epoch);

/// How a camera continues from one configuration to the next. It continues if its step is not Replace.
runtime::CameraStep step_of(const settings::DaemonSettings& before, const settings::DaemonSettings& now, CameraId id);

/// The step with the parts that it needs.
Result<runtime::CameraChange> assemble_camera_change(const settings::DaemonSettings& before,
                                                     const settings::DaemonSettings& now, CameraId id, Timestamp epoch);

}  // namespace mocap
