#pragma once

#include <memory>

#include "base/result.h"
#include "cameras/camera_settings.h"
#include "model/camera_model.h"
#include "model/skeleton.h"
#include "module/camera.h"
#include "module/stream_counters.h"

namespace mocap::cameras {

/// What a camera is given beside its own settings. All of it outlives the camera; null where there is none.
struct CameraSurroundings {
  const Rig* rig = nullptr;               ///< gives a synthetic camera its lens and place (the entry of its name)
  const MarkerSet* marker_set = nullptr;  ///< worn by the subject that a synthetic camera sees
  StreamCounters* counters = nullptr;     ///< aravis and v4l2 count here
};

/// Makes the camera that `settings` tells, not yet started; the device itself is opened by start(). `id` stands in its
/// frames. Fails with InvalidArgument where settings cannot be right whatever is plugged in.
Result<std::unique_ptr<Camera>> open_camera(CameraId id, const CameraSettings& settings,
                                            const CameraSurroundings& surroundings = {});

}  // namespace mocap::cameras
