#pragma once

#include <Eigen/Core>

#include "model/camera_model.h"
#include "model/points.h"

namespace mocap::geometry {

/// The essential matrix of two cameras: b^T E a = 0 if the rays a and b, as (x, y, 1), meet in one point. The norm of
/// E is sqrt(2) times the baseline, m; E is zero for two cameras at one position.
///
/// Source: Hartley and Zisserman, Multiple View Geometry, 2nd ed. (2004), section 9.6.
Eigen::Matrix3d essential(const CameraFromWorld& a_from_world, const CameraFromWorld& b_from_world);

/// The fundamental matrix of two cameras: b^T F a = 0 for undistorted pixels a and b, as (x, y, 1); an undistorted
/// pixel is the ray times the focal length plus the principal point.
Eigen::Matrix3d fundamental(const CameraModel& a, const CameraModel& b);

/// A line on the image plane at distance 1: n . (x, y, 1) is the signed distance of (x, y) from the line.
struct EpipolarLine {
  Eigen::Vector3d n = Eigen::Vector3d::Zero();

  double distance(const NormalizedPoint& point) const { return n[0] * point.v.x() + n[1] * point.v.y() + n[2]; }
};

/// The line in camera b on which the point of `ray_in_a` projects. Returns the zero line if the ray passes the centre
/// of camera b (relative tolerance 1e-6): then the ray constrains nothing in camera b.
EpipolarLine epipolar_line(const Eigen::Matrix3d& essential_b_from_a, const NormalizedPoint& ray_in_a);

}  // namespace mocap::geometry
