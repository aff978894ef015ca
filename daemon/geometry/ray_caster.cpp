#include "geometry/ray_caster.h"

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "geometry/lens.h"

namespace mocap::geometry {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

// By Newton's iteration, the slope by differences.
std::optional<Ray> iterate(const Lens& lens, const PixelPoint& pixel) {
  constexpr double kStep = 1e-5;  // truncation (its square) and rounding are both under 1e-9 of the slope

  const auto point = undistort(lens, pixel);
  if (!point) return std::nullopt;
  Ray ray{*point, Matrix2d::Zero()};
  for (const int axis : {0, 1}) {
    NormalizedPoint before = *point;
    NormalizedPoint after = *point;
    before.v[axis] -= kStep;
    after.v[axis] += kStep;
    ray.px_from_ray.col(axis) = (distort(lens, after).v - distort(lens, before).v) / (2.0 * kStep);
  }
  if (!(ray.px_from_ray.determinant() > 0.0)) return std::nullopt;  // where the image folds over
  return ray;
}

// The cubic Hermite polynomials at t, of the values and slopes at both ends; and their derivatives.
struct Hermite {
  double value0, slope0, value1, slope1;
};

Hermite hermite(double t) {
  const double u = 1.0 - t;
  return {u * u * (1.0 + 2.0 * t), t * u * u, t * t * (3.0 - 2.0 * t), -t * t * u};
}

Hermite hermite_slope(double t) {
  const double u = 1.0 - t;
  return {-6.0 * t * u, u * (1.0 - 3.0 * t), 6.0 * t * u, t * (3.0 * t - 2.0)};
}

}  // namespace

RayCaster::RayCaster(const CameraModel& camera) : lens_(camera.lens) {
  for (const double step_px : {32.0, 16.0}) {
    build(camera.width_px, camera.height_px, step_px);
    if (is_precise()) return;
  }
  nodes_.clear();
  columns_ = rows_ = 0;
}

std::optional<Ray> RayCaster::cast(const PixelPoint& pixel) const {
  if (auto ray = look_up(pixel)) return ray;
  return iterate(lens_, pixel);
}

RayCaster::Node RayCaster::node_at(const PixelPoint& pixel) const {
  const Vector2d nowhere = Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  const Node none{nowhere, nowhere, nowhere, nowhere};
  const auto ray = iterate(lens_, pixel);
  if (!ray) return none;
  Vector2d twist = Vector2d::Zero();
  for (const double dx : {-1.0, 1.0}) {
    for (const double dy : {-1.0, 1.0}) {
      const auto corner = undistort(lens_, {pixel.v + Vector2d(dx, dy)});
      if (!corner) return none;
      twist += 0.25 * dx * dy * corner->v;
    }
  }
  const Matrix2d ray_from_px = ray->px_from_ray.inverse();
  return {ray->point.v, ray_from_px.col(0) * step_px_, ray_from_px.col(1) * step_px_, twist * step_px_ * step_px_};
}

void RayCaster::build(int width_px, int height_px, double step_px) {
  step_px_ = step_px;
  columns_ = static_cast<int>(std::ceil(width_px / step_px));
  rows_ = static_cast<int>(std::ceil(height_px / step_px));
  nodes_.clear();
  nodes_.reserve(static_cast<std::size_t>((columns_ + 1) * (rows_ + 1)));
  for (int row = 0; row <= rows_; ++row) {
    for (int column = 0; column <= columns_; ++column) {
      nodes_.push_back(node_at({{column * step_px - 0.5, row * step_px - 0.5}}));
    }
  }
}

// Whether the table is as good as promised in the middle of each cell, where it is worst.
bool RayCaster::is_precise() {
  constexpr double kPrecision_px = 0.5e-6;

  for (int row = 0; row < rows_; ++row) {
    for (int column = 0; column < columns_; ++column) {
      const PixelPoint middle{{(column + 0.5) * step_px_ - 0.5, (row + 0.5) * step_px_ - 0.5}};
      const auto ray = look_up(middle);
      if (ray && !((distort(lens_, ray->point).v - middle.v).norm() < kPrecision_px)) return false;
    }
  }
  return true;
}

std::optional<Ray> RayCaster::look_up(const PixelPoint& pixel) const {
  const double x = (pixel.v.x() + 0.5) / step_px_;
  const double y = (pixel.v.y() + 0.5) / step_px_;
  if (!(x >= 0.0 && x < columns_ && y >= 0.0 && y < rows_)) return std::nullopt;
  const int column = static_cast<int>(x);
  const int row = static_cast<int>(y);
  const Hermite along = hermite(x - column);
  const Hermite along_slope = hermite_slope(x - column);

  // Along both rows of the cell first, then across them.
  Vector2d value[2], by_x[2], by_y[2], by_xy[2];
  for (const int k : {0, 1}) {
    const Node& a = nodes_[static_cast<std::size_t>((row + k) * (columns_ + 1) + column)];
    const Node& b = (&a)[1];
    const auto mix = [](const Hermite& h, const Vector2d& a0, const Vector2d& a1, const Vector2d& b0,
                        const Vector2d& b1) -> Vector2d {
      return h.value0 * a0 + h.slope0 * a1 + h.value1 * b0 + h.slope1 * b1;
    };
    value[k] = mix(along, a.ray, a.by_x, b.ray, b.by_x);
    by_x[k] = mix(along_slope, a.ray, a.by_x, b.ray, b.by_x);
    by_y[k] = mix(along, a.by_y, a.by_xy, b.by_y, b.by_xy);
    by_xy[k] = mix(along_slope, a.by_y, a.by_xy, b.by_y, b.by_xy);
  }
  const Hermite across = hermite(y - row);
  const Hermite across_slope = hermite_slope(y - row);
  const auto mix = [](const Hermite& h, const Vector2d* v, const Vector2d* slope) -> Vector2d {
    return h.value0 * v[0] + h.slope0 * slope[0] + h.value1 * v[1] + h.slope1 * slope[1];
  };
  Matrix2d ray_from_cell;
  ray_from_cell.col(0) = mix(across, by_x, by_xy);
  ray_from_cell.col(1) = mix(across_slope, value, by_y);
  Ray ray{{mix(across, value, by_y)}, ray_from_cell.inverse() * step_px_};
  if (!ray.point.v.allFinite()) return std::nullopt;  // a corner of the cell has no ray
  // One step of Newton's makes of the table's 1e-4 px what was promised.
  ray.point.v += ray_from_cell / step_px_ * (pixel.v - distort(lens_, ray.point).v);
  return ray;
}

}  // namespace mocap::geometry
