#pragma once

#include <cmath>

#include "model/camera_model.h"

namespace mocap::calibration {

/// x, y on the plane z = 1 to pixels, for any type of number; `lens`: fx fy cx cy, then the five of
/// model/camera_model.h. As geometry::distort.
template <class T>
void bend(LensKind kind, const T* lens, const T& x, const T& y, T* px) {
  const T* k = lens + 4;
  const T r2 = x * x + y * y;
  if (kind == LensKind::Fisheye) {
    using std::atan2;
    using std::sqrt;
    const T r = sqrt(r2 + 1e-24);
    const T angle = atan2(r, T(1.0));
    const T a2 = angle * angle;
    const T share = angle * (1.0 + a2 * (k[0] + a2 * (k[1] + a2 * (k[2] + a2 * k[3])))) / r;
    px[0] = lens[0] * x * share + lens[2];
    px[1] = lens[1] * y * share + lens[3];
    return;
  }
  const T radial = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  px[0] = lens[0] * (x * radial + 2.0 * k[2] * x * y + k[3] * (r2 + 2.0 * x * x)) + lens[2];
  px[1] = lens[1] * (y * radial + k[2] * (r2 + 2.0 * y * y) + 2.0 * k[3] * x * y) + lens[3];
}

/// A marker nearer to the camera's plane is as far outside its image as one can be.
inline constexpr double kNearest_m = 0.01;

}  // namespace mocap::calibration
