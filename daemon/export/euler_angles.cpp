#include "export/euler_angles.h"

#include <cmath>
#include <numbers>

namespace mocap::exports {
namespace {

// Cosine of the second angle below which the first and third rotation have the same axis: the angles then depend on
// rounding errors of 1e-16. Treating the cosine as 0 changes the rotation by at most this angle, rad.
constexpr double kGimbalLock = 1e-7;

double nearest_turn(double angle, double before) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  return angle + kTurn * std::round((before - angle) / kTurn);
}

Eigen::Vector3d nearest_turns(const Eigen::Vector3d& angles, const Eigen::Vector3d& before) {
  return {nearest_turn(angles[0], before[0]), nearest_turn(angles[1], before[1]), nearest_turn(angles[2], before[2])};
}

}  // namespace

Eigen::Vector3d euler_angles(const Eigen::Quaterniond& rotation, const EulerOrder& order,
                             const Eigen::Vector3d& before) {
  const auto [i, j, k] = order;
  const double sign = (j - i + 3) % 3 == 1 ? 1.0 : -1.0;  // +1: the axes follow each other as x, y, z do
  const Eigen::Matrix3d matrix = rotation.toRotationMatrix();
  const double cosine = std::hypot(matrix(i, i), matrix(i, j));
  const double second = std::atan2(sign * matrix(i, k), cosine);
  if (cosine < kGimbalLock) {
    const Eigen::Vector3d axis = Eigen::Vector3d::Unit(k);
    const Eigen::Matrix3d rest = matrix * Eigen::AngleAxisd(-before[2], axis).toRotationMatrix();
    return nearest_turns({std::atan2(sign * rest(k, j), rest(j, j)), second, before[2]}, before);
  }
  const Eigen::Vector3d one{std::atan2(-sign * matrix(j, k), matrix(k, k)), second,
                            std::atan2(-sign * matrix(i, j), matrix(i, i))};
  const Eigen::Vector3d other{one[0] + std::numbers::pi, std::numbers::pi - one[1], one[2] + std::numbers::pi};
  const Eigen::Vector3d near_one = nearest_turns(one, before);
  const Eigen::Vector3d near_other = nearest_turns(other, before);
  return (near_one - before).squaredNorm() <= (near_other - before).squaredNorm() ? near_one : near_other;
}

}  // namespace mocap::exports
