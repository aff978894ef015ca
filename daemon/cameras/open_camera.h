#pragma once

#include <memory>

#include "base/result.h"
#include "cameras/camera_settings.h"
#include "model/camera_model.h"
#include "module/camera.h"

namespace mocap::cameras {

/// Makes the camera that `settings` tells, not yet started; the device itself is opened by start(). `id` stands in its
/// frames. `rig` gives a synthetic camera its lens and place (the entry of its name); the others do not look at it.
/// Fails with InvalidArgument where settings cannot be right whatever is plugged in.
Result<std::unique_ptr<Camera>> open_camera(CameraId id, const CameraSettings& settings, const Rig& rig);

}  // namespace mocap::cameras
