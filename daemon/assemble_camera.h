#pragma once

#include <memory>

#include "base/result.h"
#include "base/time.h"
#include "cameras/node/node_clock.h"
#include "model/ids.h"
#include "module/ptp_clock.h"
#include "runtime/pipeline.h"
#include "settings/daemon_settings.h"

namespace mocap {

/// The objects that the cameras of one run share. Outlives the cameras.
struct SharedByCameras {
  Timestamp epoch;  ///< simulated cameras that run in real time start here, unless their settings have an epoch
  cameras::NodeClocks node_clocks;
  std::unique_ptr<PtpClock> ptp;  ///< null: [ptp] is off
  runtime::FailureFold node_failures;
};

/// Whether the camera delivers blobs instead of images: masks have no effect on it.
bool delivers_blobs(const cameras::CameraSettings& camera);

/// Constructs one camera with its detector and its 2D tracker; opens nothing. The settings outlive the camera.
Result<runtime::CameraParts> assemble_camera(const settings::DaemonSettings& settings, CameraId id,
                                             SharedByCameras& shared);

/// How a camera continues from one configuration to the next. It continues if its step is not Replace.
runtime::CameraStep step_of(const settings::DaemonSettings& before, const settings::DaemonSettings& now, CameraId id);

/// The step with the parts that it needs.
Result<runtime::CameraChange> assemble_camera_change(const settings::DaemonSettings& before,
                                                     const settings::DaemonSettings& now, CameraId id,
                                                     SharedByCameras& shared);

}  // namespace mocap
