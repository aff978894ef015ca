#pragma once

#include <Eigen/Core>

namespace mocap::kinematics {

inline double squared(double x) { return x * x; }

/// The skew-symmetric matrix of a vector: cross_matrix(a) * b = a x b.
inline Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d cross;
  cross << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return cross;
}

}  // namespace mocap::kinematics
