#include "geometry/ray_caster.h"

#include "geometry/lens.h"

namespace mocap::geometry {

std::optional<Ray> RayCaster::cast(const PixelPoint& pixel) const {
  // Small beside the distance over which a lens bends, large beside rounding: the slope is good to 1e-4 of itself.
  constexpr double kStep = 1e-4;

  const auto point = undistort(lens_, pixel);
  if (!point) return std::nullopt;
  Ray ray{*point, Eigen::Matrix2d::Zero()};
  for (const int axis : {0, 1}) {
    NormalizedPoint beside = *point;
    beside.v[axis] += kStep;
    ray.px_from_ray.col(axis) = (distort(lens_, beside).v - pixel.v) / kStep;
  }
  if (!(ray.px_from_ray.determinant() > 0.0)) return std::nullopt;  // where the image folds over
  return ray;
}

}  // namespace mocap::geometry
