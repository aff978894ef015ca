#include "geometry/ray_caster.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "base/expects.h"
#include "base/loops.h"
#include "geometry/lens.h"

namespace mocap::geometry {
namespace {

using Eigen::Vector2d;

constexpr std::size_t kCells = 512;

void set(RayColumns& into, std::size_t i, const std::optional<Ray>& ray) {
  into.exists[i] = ray ? 1 : 0;
  if (!ray) return;
  into.x[i] = ray->point.v.x();
  into.y[i] = ray->point.v.y();
  into.ux[i] = ray->px_from_ray(0, 0);
  into.uy[i] = ray->px_from_ray(0, 1);
  into.vx[i] = ray->px_from_ray(1, 0);
  into.vy[i] = ray->px_from_ray(1, 1);
}

}  // namespace

std::optional<Ray> ray_of(const Lens& lens, const PixelPoint& pixel) {
  const auto point = undistort(lens, pixel);
  if (!point) return std::nullopt;
  const Ray ray{*point, distort_with_slope(lens, *point).px_from_ray};
  if (!(ray.px_from_ray.determinant() > 0.0)) return std::nullopt;  // where the image folds over
  return ray;
}

RayColumns::RayColumns(std::size_t max_rays) {
  for (auto* column : {&x, &y, &ux, &uy, &vx, &vy}) column->reserve(max_rays);
  exists.reserve(max_rays);
}

void RayColumns::resize(std::size_t rays) {
  MOCAP_EXPECTS(rays <= exists.capacity());
  for (auto* column : {&x, &y, &ux, &uy, &vx, &vy}) column->resize(rays);
  exists.resize(rays);
}

Ray RayColumns::operator[](std::size_t i) const {
  Ray ray{{{x[i], y[i]}}, {}};
  ray.px_from_ray << ux[i], uy[i], vx[i], vy[i];
  return ray;
}

void RayColumns::drop_missing() {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < exists.size(); ++i) {
    if (exists[i] == 0) continue;
    for (auto* column : {&x, &y, &ux, &uy, &vx, &vy}) (*column)[kept] = (*column)[i];
    exists[kept++] = 1;
  }
  resize(kept);
}

RayCaster::RayCaster(const CameraModel& camera)
    : lens_(camera.lens), width_px_(camera.width_px), height_px_(camera.height_px) {
  constexpr int kMostSteps = 3;
  if (lens_.kind != LensKind::Pinhole) return;
  tabulate();
  for (steps_ = 1; steps_ <= kMostSteps; ++steps_) {
    if (is_precise()) return;
  }
  steps_ = 0;
}

// How much longer than the distorted ray the ray is, by the radial part of the distortion alone.
void RayCaster::tabulate() {
  Lens radial;
  radial.distortion = lens_.distortion;
  radial.distortion[2] = radial.distortion[3] = 0.0;
  const double right = std::max(lens_.cx_px + 0.5, width_px_ - 0.5 - lens_.cx_px) / lens_.fx_px;
  const double down = std::max(lens_.cy_px + 0.5, height_px_ - 0.5 - lens_.cy_px) / lens_.fy_px;
  const double farthest2 = std::max(1e-6, right * right + down * down);
  cells_per_length2_ = static_cast<double>(kCells) / farthest2;
  scale_.assign(1, 1.0);
  for (std::size_t i = 1; i <= kCells + 1; ++i) {
    const double length = std::sqrt(static_cast<double>(i) / cells_per_length2_);
    const auto ray = ray_of(radial, {{length, 0.0}});
    if (!ray) break;  // from here on the image folds over
    scale_.push_back(ray->point.v.x() / length);
  }
}

// Whether the table is as good as promised all over the image.
bool RayCaster::is_precise() const {
  constexpr double kPrecision_px = 0.5e-6;
  constexpr double kStep_px = 8.0;

  std::vector<double> u;
  for (double at = -0.5; at < width_px_ - 0.5; at += kStep_px) u.push_back(at);
  std::vector<double> v(u.size());
  RayColumns found(u.size());
  for (double at = -0.5; at < height_px_ - 0.5; at += kStep_px) {
    std::ranges::fill(v, at);
    cast(u, v, found);
    for (std::size_t i = 0; i < u.size(); ++i) {
      if (found.exists[i] == 0) continue;
      const Vector2d off_px = distort(lens_, found[i].point).v - Vector2d(u[i], v[i]);
      if (!(off_px.norm() < kPrecision_px)) return false;
    }
  }
  return true;
}

void RayCaster::cast(std::span<const double> u_px, std::span<const double> v_px, RayColumns& into) const {
  MOCAP_EXPECTS(u_px.size() == v_px.size());
  into.resize(u_px.size());
  if (steps_ > 0) {
    find_cells(u_px, v_px, into);
    look_up(into);
    polish(u_px, v_px, into);
  } else {
    std::ranges::fill(into.exists, std::uint8_t{0});
  }
  const auto is_done = [&into](std::size_t i) {
    return (into.exists[i] != 0) & (into.ux[i] * into.vy[i] > into.uy[i] * into.vx[i]);
  };
  std::size_t done = 0;
  for (std::size_t i = 0; i < u_px.size(); ++i) done += is_done(i) ? 1 : 0;
  if (done == u_px.size()) return;
  for (std::size_t i = 0; i < u_px.size(); ++i) {
    if (!is_done(i)) set(into, i, ray_of(lens_, {{u_px[i], v_px[i]}}));
  }
}

// The distorted rays, and where in the table each is (for now in ux); `exists` says whether it is in the image and in
// the table. What is not gets any place: it is done anew.
MOCAP_WIDE void RayCaster::find_cells(std::span<const double> u_px, std::span<const double> v_px,
                                      RayColumns& into) const {
  const double last = static_cast<double>(scale_.size()) - 2.0;
  const double inverse_fx = 1.0 / lens_.fx_px;
  const double inverse_fy = 1.0 / lens_.fy_px;
  const double cx = lens_.cx_px, cy = lens_.cy_px;
  const double right = width_px_ - 0.5, down = height_px_ - 0.5;
  const double cells = cells_per_length2_;
  const double *u = u_px.data(), *v = v_px.data();
  double *px = into.x.data(), *py = into.y.data(), *cell = into.ux.data();
  const std::size_t count = u_px.size();
  MOCAP_INDEPENDENT_TURNS
  for (std::size_t i = 0; i < count; ++i) {
    const double x = (u[i] - cx) * inverse_fx;
    const double y = (v[i] - cy) * inverse_fy;
    const double at = (x * x + y * y) * cells;
    px[i] = x;
    py[i] = y;
    cell[i] = at < last ? at : last;
  }
  for (std::size_t i = 0; i < count; ++i) {
    const bool in_image = (u[i] >= -0.5) & (u[i] < right) & (v[i] >= -0.5) & (v[i] < down);
    into.exists[i] = static_cast<std::uint8_t>(in_image & (cell[i] < last));
  }
}

// How long each ray is by the table (in uy).
void RayCaster::look_up(RayColumns& into) const {
  for (std::size_t i = 0; i < into.exists.size(); ++i) {
    const double cell = into.exists[i] != 0 ? into.ux[i] : 0.0;
    const auto index = static_cast<std::size_t>(cell);
    into.uy[i] = scale_[index] + (cell - static_cast<double>(index)) * (scale_[index + 1] - scale_[index]);
  }
}

// The tangential part is taken off at the table's guess; Newton's steps from there. The slope is that of the point
// before the last step: the step is so small that the slope does not change.
MOCAP_WIDE void RayCaster::polish(std::span<const double> u_px, std::span<const double> v_px, RayColumns& into) const {
  const double k1 = lens_.distortion[0];
  const double k2 = lens_.distortion[1];
  const double k3 = lens_.distortion[4];
  const double p1 = lens_.distortion[2];
  const double p2 = lens_.distortion[3];
  const double fx = lens_.fx_px;
  const double fy = lens_.fy_px;
  const double cx = lens_.cx_px;
  const double cy = lens_.cy_px;
  const std::size_t count = u_px.size();
  const double* const u = u_px.data();
  const double* const v = v_px.data();
  double* const px = into.x.data();
  double* const py = into.y.data();
  double* const ux = into.ux.data();
  double* const uy = into.uy.data();
  double* const vx = into.vx.data();
  double* const vy = into.vy.data();
  MOCAP_INDEPENDENT_TURNS
  for (std::size_t i = 0; i < count; ++i) {
    const double scale = uy[i];
    const double x = px[i] * scale;
    const double y = py[i] * scale;
    const double r2 = x * x + y * y;
    px[i] = (px[i] - 2.0 * p1 * x * y - p2 * (r2 + 2.0 * x * x)) * scale;
    py[i] = (py[i] - p1 * (r2 + 2.0 * y * y) - 2.0 * p2 * x * y) * scale;
  }
  for (int step = 0; step < steps_; ++step) {
    MOCAP_INDEPENDENT_TURNS
    for (std::size_t i = 0; i < count; ++i) {
      const double x = px[i];
      const double y = py[i];
      const double xy = x * y;
      const double r2 = x * x + y * y;
      const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
      const double slope2 = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));  // twice d radial / d r2
      const double off_u = u[i] - cx - fx * (x * radial + 2.0 * p1 * xy + p2 * (r2 + 2.0 * x * x));
      const double off_v = v[i] - cy - fy * (y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * xy);
      const double across = xy * slope2 + 2.0 * (p1 * x + p2 * y);
      const double a = fx * (radial + x * x * slope2 + 2.0 * p1 * y + 6.0 * p2 * x);
      const double b = fx * across;
      const double c = fy * across;
      const double d = fy * (radial + y * y * slope2 + 6.0 * p1 * y + 2.0 * p2 * x);
      const double inverse = 1.0 / (a * d - b * c);
      px[i] = x + (d * off_u - b * off_v) * inverse;
      py[i] = y + (a * off_v - c * off_u) * inverse;
      ux[i] = a;
      uy[i] = b;
      vx[i] = c;
      vy[i] = d;
    }
  }
}

}  // namespace mocap::geometry
