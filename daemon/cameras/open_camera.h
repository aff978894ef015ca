#pragma once

#include <memory>

#include "base/result.h"
#include "cameras/camera_make.h"
#include "cameras/camera_settings.h"
#include "model/ids.h"
#include "module/camera.h"

namespace mocap::cameras {

/// Makes the camera that `settings` describe; its start() opens the device. `id` is written into its frames. Fails with
/// InvalidArgument if the settings are invalid for every device.
Result<std::unique_ptr<Camera>> open_camera(CameraId id, const CameraSettings& settings,
                                            const CameraSurroundings& surroundings = {});

}  // namespace mocap::cameras
