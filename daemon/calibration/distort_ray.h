#pragma once

#include <cmath>

#include "model/camera_model.h"

namespace mocap::calibration {

/// Projects the ray (x, y, 1) to a pixel, for any number type (double, or a Jet of Ceres' automatic differentiation).
/// `intrinsics`: fx fy cx cy in px, then the five distortion coefficients of Lens. Same model as geometry::distort.
template <class T>
void distort_ray(LensKind kind, const T* intrinsics, const T& x, const T& y, T* px) {
  const T* k = intrinsics + 4;
  const T r2 = x * x + y * y;
  if (kind == LensKind::Fisheye) {
    using std::atan2;
    using std::sqrt;
    const T r = sqrt(r2 + 1e-24);  // the derivative of the square root at 0 is infinite
    const T angle = atan2(r, T(1.0));
    const T a2 = angle * angle;
    const T scale = angle * (1.0 + a2 * (k[0] + a2 * (k[1] + a2 * (k[2] + a2 * k[3])))) / r;
    px[0] = intrinsics[0] * x * scale + intrinsics[2];
    px[1] = intrinsics[1] * y * scale + intrinsics[3];
    return;
  }
  const T radial = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  px[0] = intrinsics[0] * (x * radial + 2.0 * k[2] * x * y + k[3] * (r2 + 2.0 * x * x)) + intrinsics[2];
  px[1] = intrinsics[1] * (y * radial + k[2] * (r2 + 2.0 * y * y) + 2.0 * k[3] * x * y) + intrinsics[3];
}

/// The depth that cost functions use for a point that is nearer to the camera's plane or behind it: the projection
/// stays finite and lies far outside the image. As geometry::project, which refuses such points.
inline constexpr double kMinDepth_m = 0.01;

}  // namespace mocap::calibration
