#include "geometry/epipolar.h"

#include <Eigen/Geometry>

namespace mocap::geometry {
namespace {

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& t) {
  Eigen::Matrix3d m;
  m << 0.0, -t.z(), t.y(), t.z(), 0.0, -t.x(), -t.y(), t.x(), 0.0;
  return m;
}

// Maps undistorted pixels (x, y, 1) to rays (x, y, 1).
Eigen::Matrix3d ray_from_pixel(const Lens& lens) {
  Eigen::Matrix3d m;
  m << 1.0 / lens.fx_px, 0.0, -lens.cx_px / lens.fx_px, 0.0, 1.0 / lens.fy_px, -lens.cy_px / lens.fy_px, 0.0, 0.0, 1.0;
  return m;
}

}  // namespace

Eigen::Matrix3d essential(const CameraFromWorld& a_from_world, const CameraFromWorld& b_from_world) {
  const auto b_from_a = b_from_world * a_from_world.inverse();
  return cross_matrix(b_from_a.translation) * b_from_a.rotation;
}

Eigen::Matrix3d fundamental(const CameraModel& a, const CameraModel& b) {
  return ray_from_pixel(b.lens).transpose() * essential(a.camera_from_world, b.camera_from_world) *
         ray_from_pixel(a.lens);
}

EpipolarLine epipolar_line(const Eigen::Matrix3d& essential_b_from_a, const NormalizedPoint& ray_in_a) {
  constexpr double kNearlyThrough = 1e-6;

  const Eigen::Vector3d line = essential_b_from_a * ray_in_a.v.homogeneous();
  const double slope = line.head<2>().norm();
  if (!(slope > kNearlyThrough * essential_b_from_a.norm())) return {};
  return {line / slope};
}

}  // namespace mocap::geometry
