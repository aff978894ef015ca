#pragma once

#include <Eigen/Core>

#include "model/camera_model.h"
#include "model/points.h"

namespace mocap::geometry {

/// The essential matrix of two cameras: b^T E a = 0 for the rays a and b, written (x, y, 1), on which they see one
/// point. Its length is that of the baseline, m; zero for two cameras in one place.
///
/// Source: Hartley and Zisserman, Multiple View Geometry, 2nd ed. (2004), section 9.6.
Eigen::Matrix3d essential(const CameraFromWorld& a_from_world, const CameraFromWorld& b_from_world);

/// The fundamental matrix of two cameras: b^T F a = 0 for pixels a and b, written (x, y, 1), from which the distortion
/// has been undone (ray times focal length plus image centre).
Eigen::Matrix3d fundamental(const CameraModel& a, const CameraModel& b);

/// A line on the image plane at distance 1: n . (x, y, 1) is the signed distance of (x, y) to it.
struct EpipolarLine {
  Eigen::Vector3d n = Eigen::Vector3d::Zero();

  double distance(const NormalizedPoint& point) const { return n[0] * point.v.x() + n[1] * point.v.y() + n[2]; }
};

/// Where camera b may see what camera a sees at `ray_in_a`. The zero line where a's ray leads through the centre of b,
/// or nearly (within 1e-6 of the baseline): then every point of b fits, and distances to it tell nothing.
EpipolarLine epipolar_line(const Eigen::Matrix3d& essential_b_from_a, const NormalizedPoint& ray_in_a);

}  // namespace mocap::geometry
