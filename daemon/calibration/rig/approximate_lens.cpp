#include "calibration/rig/approximate_lens.h"

#include <cmath>
#include <numbers>

#include "model/calibration/calibrated_camera.h"

namespace mocap::calibration {

Lens lens_of(const ApproximateLens& approximate, int width_px, int height_px) {
  const double half_rad = 0.5 * approximate.fov_deg * std::numbers::pi / 180.0;
  Lens lens;
  lens.kind = approximate.kind;
  lens.fx_px = 0.5 * width_px / (approximate.kind == LensKind::Fisheye ? half_rad : std::tan(half_rad));
  lens.fy_px = lens.fx_px;
  lens.cx_px = 0.5 * (width_px - 1);
  lens.cy_px = 0.5 * (height_px - 1);
  lens.is_from_fov = true;
  return lens;
}

bool takes_field_of_view(const CameraModel& camera) { return !is_calibrated(camera) || camera.lens.is_from_fov; }

std::optional<std::string> lenses_that_are_kept(const Rig& rig) {
  std::string names;
  for (const CameraModel& camera : rig) {
    if (!takes_field_of_view(camera)) names += (names.empty() ? "'" : ", '") + camera.name + "'";
  }
  if (names.empty()) return std::nullopt;
  return "calibrated lenses are kept, and the field of view is not used for them: " + names;
}

}  // namespace mocap::calibration
