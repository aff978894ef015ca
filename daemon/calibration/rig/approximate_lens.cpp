#include "calibration/rig/approximate_lens.h"

#include <cmath>
#include <numbers>

namespace mocap::calibration {

Lens lens_of(const ApproximateLens& approximate, int width_px, int height_px) {
  const double half_rad = 0.5 * approximate.fov_deg * std::numbers::pi / 180.0;
  Lens lens;
  lens.kind = approximate.kind;
  lens.fx_px = 0.5 * width_px / (approximate.kind == LensKind::Fisheye ? half_rad : std::tan(half_rad));
  lens.fy_px = lens.fx_px;
  lens.cx_px = 0.5 * (width_px - 1);
  lens.cy_px = 0.5 * (height_px - 1);
  return lens;
}

}  // namespace mocap::calibration
