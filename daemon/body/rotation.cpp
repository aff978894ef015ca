#include "body/rotation.h"

#include <cmath>

namespace mocap::body {

Eigen::Quaterniond turn_by(const Eigen::Vector3d& rotation_rad) {
  const double angle = rotation_rad.norm();
  // sin(a/2)/a, by its series where the quotient would lose digits.
  const double share = angle > 1e-6 ? std::sin(0.5 * angle) / angle : 0.5 - angle * angle / 48.0;
  const Eigen::Vector3d v = share * rotation_rad;
  return Eigen::Quaterniond(std::cos(0.5 * angle), v.x(), v.y(), v.z()).normalized();
}

Eigen::Vector3d rotation_vector(const Eigen::Quaterniond& turn) {
  const double side = turn.w() < 0.0 ? -1.0 : 1.0;
  const Eigen::Vector3d v = side * turn.vec();
  const double sine = v.norm();
  if (sine < 1e-9) return 2.0 * v;
  return v * (2.0 * std::atan2(sine, side * turn.w()) / sine);
}

Eigen::Matrix3d change_of_rotation_vector(const Eigen::Vector3d& phi) {
  const double angle = phi.norm();
  Eigen::Matrix3d cross;
  cross << 0.0, -phi.z(), phi.y(), phi.z(), 0.0, -phi.x(), -phi.y(), phi.x(), 0.0;
  const double half = 0.5 * angle;
  const double share = angle > 1e-4 ? (1.0 - half * std::cos(half) / std::sin(half)) / (angle * angle) : 1.0 / 12.0;
  return Eigen::Matrix3d::Identity() - 0.5 * cross + share * cross * cross;
}

Eigen::Quaterniond same_side(const Eigen::Quaterniond& q, const Eigen::Quaterniond& last) {
  return q.coeffs().dot(last.coeffs()) < 0.0 ? Eigen::Quaterniond(-q.coeffs()) : q;
}

}  // namespace mocap::body
