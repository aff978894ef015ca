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
  if (!(ray.px_from_ray.determinant() > 0.0)) return std::nullopt;  // the distortion folds the image over
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
  if (scale_.size() < 3) return;
  for (steps_ = 1; steps_ <= kMostSteps; ++steps_) {
    if (is_precise()) return;
  }
  steps_ = 0;
}

// Tabulates the length of the ray divided by the length of the distorted ray, for the radial distortion alone.
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
    if (!ray) break;  // beyond this length the distortion folds the image over
    scale_.push_back(ray->point.v.x() / length);
  }
}

// Whether table and Newton steps give rays to 0.5e-6 px, tested on a grid of 8 px over the whole image.
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
    bool all_valid = look_up(u_px, v_px, into);
    for (int step = 0; step < steps_; ++step) all_valid = polish(u_px, v_px, into) && all_valid;
    std::ranges::fill(into.exists, std::uint8_t{1});
    if (all_valid) return;
  }
  for (std::size_t i = 0; i < u_px.size(); ++i) {
    const bool valid = steps_ > 0 && is_in_table(u_px[i], v_px[i]) && into.ux[i] * into.vy[i] > into.uy[i] * into.vx[i];
    if (!valid) set(into, i, ray_of(lens_, {{u_px[i], v_px[i]}}));
  }
}

// Whether the pixel is inside the image and the table covers the length of its distorted ray.
bool RayCaster::is_in_table(double u_px, double v_px) const {
  const double x = (u_px - lens_.cx_px) / lens_.fx_px;
  const double y = (v_px - lens_.cy_px) / lens_.fy_px;
  const bool in_image = u_px >= -0.5 && u_px < width_px_ - 0.5 && v_px >= -0.5 && v_px < height_px_ - 0.5;
  return in_image && (x * x + y * y) * cells_per_length2_ < static_cast<double>(scale_.size()) - 2.0;
}

namespace {

// The parameters of a pinhole lens, and one Newton step with them. The returned derivative belongs to the point before
// the step: the last step is so small that the derivative does not change.
struct Step {
  explicit Step(const Lens& lens)
      : k1(lens.distortion[0]),
        k2(lens.distortion[1]),
        k3(lens.distortion[4]),
        p1(lens.distortion[2]),
        p2(lens.distortion[3]),
        fx(lens.fx_px),
        fy(lens.fy_px),
        cx(lens.cx_px),
        cy(lens.cy_px) {}

  struct Polished {
    double x, y, a, b, c, d;
  };
  [[gnu::always_inline]] Polished operator()(double x, double y, double u, double v) const {
    const double xy = x * y;
    const double r2 = x * x + y * y;
    const double radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3));
    const double slope2 = 2.0 * (k1 + r2 * (2.0 * k2 + r2 * 3.0 * k3));  // twice d radial / d r2
    const double off_u = u - cx - fx * (x * radial + 2.0 * p1 * xy + p2 * (r2 + 2.0 * x * x));
    const double off_v = v - cy - fy * (y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * xy);
    const double across = xy * slope2 + 2.0 * (p1 * x + p2 * y);
    const double a = fx * (radial + x * x * slope2 + 2.0 * p1 * y + 6.0 * p2 * x);
    const double b = fx * across;
    const double c = fy * across;
    const double d = fy * (radial + y * y * slope2 + 6.0 * p1 * y + 2.0 * p2 * x);
    const double inverse = 1.0 / (a * d - b * c);
    return {x + (d * off_u - b * off_v) * inverse, y + (a * off_v - c * off_u) * inverse, a, b, c, d};
  }

  double k1, k2, k3, p1, p2, fx, fy, cx, cy;
};

}  // namespace

// Initial rays: radial distortion from the table, tangential distortion subtracted at the rays that the table gives.
// Returns whether all pixels are inside the image and the table.
//
// Table lookup and Newton steps are separate loops. All operations on one ray depend on each other, and a processor
// executes several iterations in parallel only if the loop is short.
MOCAP_WIDE bool RayCaster::look_up(std::span<const double> u_px, std::span<const double> v_px, RayColumns& into) const {
  const Step step(lens_);
  const double p1 = step.p1, p2 = step.p2, cx = step.cx, cy = step.cy;
  const double inverse_fx = 1.0 / lens_.fx_px;
  const double inverse_fy = 1.0 / lens_.fy_px;
  const double right = width_px_ - 0.5, down = height_px_ - 0.5;
  const double cells = cells_per_length2_;
  const double last = static_cast<double>(scale_.size()) - 2.0;
  const double *u = u_px.data(), *v = v_px.data(), *table = scale_.data();
  double *px = into.x.data(), *py = into.y.data();
  const std::size_t count = u_px.size();
  std::int64_t valid = 0;
  MOCAP_INDEPENDENT_TURNS
  for (std::size_t i = 0; i < count; ++i) {
    const double long_x = (u[i] - cx) * inverse_fx;
    const double long_y = (v[i] - cy) * inverse_fy;
    const double at = (long_x * long_x + long_y * long_y) * cells;
    const double cell = at < last ? at : last;  // NaN gives `last`
    const auto index = static_cast<std::int32_t>(cell);
    const double slope = table[index + 1] - table[index];
    const double guess = table[index] + (cell - static_cast<double>(index)) * slope;
    const double x = long_x * guess;
    const double y = long_y * guess;
    const double r2 = x * x + y * y;
    const double radial_x = long_x - 2.0 * p1 * x * y - p2 * (r2 + 2.0 * x * x);
    const double radial_y = long_y - p1 * (r2 + 2.0 * y * y) - 2.0 * p2 * x * y;
    // Without the tangential distortion the length differs by a cell or two of the table.
    const double scale = guess + ((radial_x * radial_x + radial_y * radial_y) * cells - at) * slope;
    px[i] = radial_x * scale;
    py[i] = radial_y * scale;
    const bool in_image = (u[i] >= -0.5) & (u[i] < right) & (v[i] >= -0.5) & (v[i] < down);
    valid += in_image & (at < last) ? 1 : 0;
  }
  return valid == static_cast<std::int64_t>(count);
}

// One Newton step. Returns whether the distortion folds the image over at none of the rays.
MOCAP_WIDE bool RayCaster::polish(std::span<const double> u_px, std::span<const double> v_px, RayColumns& into) const {
  const Step step(lens_);
  const double *u = u_px.data(), *v = v_px.data();
  double *px = into.x.data(), *py = into.y.data(), *ux = into.ux.data(), *uy = into.uy.data(), *vx = into.vx.data(),
         *vy = into.vy.data();
  const std::size_t count = u_px.size();
  std::int64_t upright = 0;
  MOCAP_INDEPENDENT_TURNS
  for (std::size_t i = 0; i < count; ++i) {
    const auto polished = step(px[i], py[i], u[i], v[i]);
    px[i] = polished.x;
    py[i] = polished.y;
    ux[i] = polished.a;
    uy[i] = polished.b;
    vx[i] = polished.c;
    vy[i] = polished.d;
    upright += polished.a * polished.d > polished.b * polished.c ? 1 : 0;
  }
  return upright == static_cast<std::int64_t>(count);
}

}  // namespace mocap::geometry
