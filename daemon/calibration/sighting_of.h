#pragma once

#include "geometry/triangulation.h"
#include "model/camera_model.h"

namespace mocap::calibration {

/// A ray of a camera as triangulation takes it; borrows the camera.
geometry::Sighting sighting_of(const CameraModel& camera, const NormalizedPoint& ray, double sigma_px);

}  // namespace mocap::calibration
