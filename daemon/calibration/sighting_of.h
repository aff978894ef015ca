#pragma once

#include "geometry/triangulation.h"
#include "model/camera_model.h"

namespace mocap::calibration {

/// The input of geometry::triangulate for an undistorted ray of a camera. The result keeps a pointer to the pose of
/// `camera`, which must outlive it.
geometry::Sighting sighting_of(const CameraModel& camera, const NormalizedPoint& ray, double sigma_px);

}  // namespace mocap::calibration
