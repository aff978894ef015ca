#pragma once

#include "model/camera_model.h"

namespace mocap {

/// Whether the camera has an entry in the rig. A camera without one has no focal length, and perhaps no image size.
inline bool is_calibrated(const CameraModel& camera) {
  return camera.width_px > 0 && camera.height_px > 0 && camera.lens.fx_px > 1.0;
}

}  // namespace mocap
