#include "geometry/lens.h"

#include <Eigen/Dense>
#include <cmath>

#include "geometry/limits.h"

namespace mocap::geometry {
namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;

// A distorted ray, and its derivative by the ray.
struct Distorted {
  Vector2d v;
  Matrix2d jacobian;
};

Distorted distort_pinhole(const Eigen::Matrix<double, 5, 1>& k, const Vector2d& ray) {
  const double x = ray.x();
  const double y = ray.y();
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  const double slope = k[0] + r2 * (2.0 * k[1] + r2 * 3.0 * k[4]);  // d radial / d r2
  const double p1 = k[2];
  const double p2 = k[3];
  const Vector2d v(x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
                   y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y);
  Matrix2d j;
  j(0, 0) = radial + 2.0 * x * x * slope + 2.0 * p1 * y + 6.0 * p2 * x;
  j(0, 1) = 2.0 * x * y * slope + 2.0 * p1 * x + 2.0 * p2 * y;
  j(1, 0) = j(0, 1);
  j(1, 1) = radial + 2.0 * y * y * slope + 6.0 * p1 * y + 2.0 * p2 * x;
  return {v, j};
}

// The distorted angle from the optical axis, and its derivative by theta.
std::pair<double, double> fisheye_angle(const Eigen::Matrix<double, 5, 1>& k, double theta) {
  const double t2 = theta * theta;
  const double value = theta * (1.0 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))));
  const double slope = 1.0 + t2 * (3.0 * k[0] + t2 * (5.0 * k[1] + t2 * (7.0 * k[2] + t2 * 9.0 * k[3])));
  return {value, slope};
}

Distorted distort_fisheye(const Eigen::Matrix<double, 5, 1>& k, const Vector2d& ray) {
  const double r = ray.norm();
  if (r < 1e-12) return {ray, Matrix2d::Identity()};
  const auto [angle, slope] = fisheye_angle(k, std::atan(r));
  const double scale = angle / r;
  // The derivative is d angle / d r along the radius, and the scale across it.
  const double along = slope / (1.0 + r * r);
  return {ray * scale, scale * Matrix2d::Identity() + (along - scale) / (r * r) * ray * ray.transpose()};
}

Distorted distort_ray(const Lens& lens, const Vector2d& ray) {
  return lens.kind == LensKind::Fisheye ? distort_fisheye(lens.distortion, ray) : distort_pinhole(lens.distortion, ray);
}

constexpr int kMaxUndistortSteps = 30;
constexpr double kSolved = 1e-12;  // on the image plane at distance 1; far below any centroid error

std::optional<Vector2d> undistort_pinhole(const Eigen::Matrix<double, 5, 1>& k, const Vector2d& target) {
  Vector2d ray = target;
  for (int step = 0; step < kMaxUndistortSteps; ++step) {
    const Distorted now = distort_pinhole(k, ray);
    const Vector2d error = now.v - target;
    // Beyond the maximum of the distortion polynomial the image folds over itself: no ray maps to that pixel.
    if (!(now.jacobian.determinant() > 1e-6) || !ray.allFinite()) return std::nullopt;
    if (error.squaredNorm() < kSolved * kSolved) return ray;
    ray -= now.jacobian.inverse() * error;
  }
  return std::nullopt;
}

std::optional<Vector2d> undistort_fisheye(const Eigen::Matrix<double, 5, 1>& k, const Vector2d& target) {
  constexpr double kRightAngle = 1.5707963267948966;
  const double r = target.norm();
  if (r < 1e-12) return target;
  double theta = std::min(r, kRightAngle - 1e-3);
  for (int step = 0; step < kMaxUndistortSteps; ++step) {
    const auto [value, slope] = fisheye_angle(k, theta);
    if (!(slope > 1e-6)) return std::nullopt;
    if (std::abs(value - r) < kSolved) {
      if (theta <= 0.0 || theta >= kRightAngle - 1e-6) return std::nullopt;  // the ray does not meet the plane z = 1
      return target * (std::tan(theta) / r);
    }
    theta -= (value - r) / slope;
  }
  return std::nullopt;
}

}  // namespace

PixelPoint distort(const Lens& lens, const NormalizedPoint& ray) {
  const Vector2d d = distort_ray(lens, ray.v).v;
  return {{lens.fx_px * d.x() + lens.cx_px, lens.fy_px * d.y() + lens.cy_px}};
}

DistortedRay distort_with_slope(const Lens& lens, const NormalizedPoint& ray) {
  const auto [d, jacobian] = distort_ray(lens, ray.v);
  return {{{lens.fx_px * d.x() + lens.cx_px, lens.fy_px * d.y() + lens.cy_px}},
          Vector2d(lens.fx_px, lens.fy_px).asDiagonal() * jacobian};
}

std::optional<NormalizedPoint> undistort(const Lens& lens, const PixelPoint& pixel) {
  const Vector2d target((pixel.v.x() - lens.cx_px) / lens.fx_px, (pixel.v.y() - lens.cy_px) / lens.fy_px);
  const auto ray = lens.kind == LensKind::Fisheye ? undistort_fisheye(lens.distortion, target)
                                                  : undistort_pinhole(lens.distortion, target);
  if (!ray) return std::nullopt;
  return NormalizedPoint{*ray};
}

std::optional<PixelPoint> project(const CameraModel& camera, const WorldPoint& point) {
  const CameraPoint seen = camera.camera_from_world * point;
  if (seen.v.z() < kMinDepth_m) return std::nullopt;
  return distort(camera.lens, NormalizedPoint{seen.v.head<2>() / seen.v.z()});
}

bool in_image(const CameraModel& camera, const PixelPoint& pixel) {
  return pixel.v.x() >= -0.5 && pixel.v.y() >= -0.5 && pixel.v.x() < camera.width_px - 0.5 &&
         pixel.v.y() < camera.height_px - 0.5;
}

}  // namespace mocap::geometry
