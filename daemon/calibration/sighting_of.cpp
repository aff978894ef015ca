#include "calibration/sighting_of.h"

#include "geometry/lens.h"

namespace mocap::calibration {

geometry::Sighting sighting_of(const CameraModel& camera, const NormalizedPoint& ray, double sigma_px) {
  geometry::Sighting sighting;
  sighting.camera_from_world = &camera.camera_from_world;
  sighting.point = ray;
  sighting.px_from_ray = geometry::distort_with_slope(camera.lens, ray).px_from_ray;
  sighting.sigma_px = sigma_px;
  return sighting;
}

}  // namespace mocap::calibration
