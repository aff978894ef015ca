#include "kinematics/rotation.h"

#include <cmath>

#include "kinematics/algebra.h"

namespace mocap::kinematics {

Eigen::Quaterniond from_rotation_vector(const Eigen::Vector3d& rotation_rad) {
  const double squared = rotation_rad.squaredNorm();
  // Most steps of a fit are small rotations: Taylor series of sine and cosine, truncated below 1e-13.
  if (squared < 0.02) {
    const double h = 0.25 * squared;  // squared half angle
    const double coefficient = 0.5 * (1.0 - h / 6.0 * (1.0 - h / 20.0 * (1.0 - h / 42.0 * (1.0 - h / 72.0))));
    const double w = 1.0 - h / 2.0 * (1.0 - h / 12.0 * (1.0 - h / 30.0 * (1.0 - h / 56.0)));
    return {w, coefficient * rotation_rad.x(), coefficient * rotation_rad.y(), coefficient * rotation_rad.z()};
  }
  const double angle = std::sqrt(squared);
  const Eigen::Vector3d v = std::sin(0.5 * angle) / angle * rotation_rad;
  return Eigen::Quaterniond(std::cos(0.5 * angle), v.x(), v.y(), v.z()).normalized();
}

Eigen::Vector3d rotation_vector(const Eigen::Quaterniond& rotation) {
  const double side = rotation.w() < 0.0 ? -1.0 : 1.0;
  const Eigen::Vector3d v = side * rotation.vec();
  const double squared = v.squaredNorm();
  // Taylor series of the arc sine, truncated below 1e-13.
  if (squared < 0.004) {
    const double s = squared;
    return 2.0 * (1.0 + s * (1.0 / 6.0 + s * (3.0 / 40.0 + s * (5.0 / 112.0 + s * (35.0 / 1152.0))))) * v;
  }
  const double sine = std::sqrt(squared);
  return v * (2.0 * std::atan2(sine, side * rotation.w()) / sine);
}

Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d a = from.normalized(), b = to.normalized();
  const double twice_cosine = (a + b).norm();  // of the half angle
  constexpr double kOpposite = 1e-6;
  if (!(twice_cosine > kOpposite)) {
    const Eigen::Vector3d axis = a.unitOrthogonal();
    return {0.0, axis.x(), axis.y(), axis.z()};
  }
  const Eigen::Vector3d v = a.cross(b) / twice_cosine;
  return Eigen::Quaterniond(0.5 * twice_cosine, v.x(), v.y(), v.z()).normalized();
}

namespace {

// The square of the cross matrix: v v^T - |v|^2 I.
Eigen::Matrix3d cross_squared(const Eigen::Vector3d& v) {
  Eigen::Matrix3d squared = v * v.transpose();
  squared.diagonal().array() -= v.squaredNorm();
  return squared;
}

}  // namespace

Eigen::Matrix3d inverse_left_jacobian(const Eigen::Vector3d& phi) {
  const double a = phi.squaredNorm();
  double coefficient = 1.0 / 12.0 + a * (1.0 / 720.0 + a * (1.0 / 30240.0 + a / 1209600.0));
  if (a > 0.01) {
    const double half = 0.5 * std::sqrt(a);
    coefficient = (1.0 - half * std::cos(half) / std::sin(half)) / a;
  }
  return Eigen::Matrix3d::Identity() - 0.5 * cross_matrix(phi) + coefficient * cross_squared(phi);
}

Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& phi) {
  const double a = phi.squaredNorm();
  double first = 0.5 - a * (1.0 / 24.0 - a / 720.0);
  double second = 1.0 / 6.0 - a * (1.0 / 120.0 - a / 5040.0);
  if (a > 1e-3) {
    const double angle = std::sqrt(a);
    first = (1.0 - std::cos(angle)) / a;
    second = (angle - std::sin(angle)) / (a * angle);
  }
  return Eigen::Matrix3d::Identity() + first * cross_matrix(phi) + second * cross_squared(phi);
}

Eigen::Quaterniond same_hemisphere(const Eigen::Quaterniond& q, const Eigen::Quaterniond& last) {
  return q.coeffs().dot(last.coeffs()) < 0.0 ? Eigen::Quaterniond(-q.coeffs()) : q;
}

}  // namespace mocap::kinematics
