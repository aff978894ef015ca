#include "geometry/rigid_fit.h"

#include <Eigen/SVD>
#include <cmath>

namespace mocap::geometry {
namespace {

// Points on one line do not determine the rotation about the line. The bound is far above rounding and far below the
// ratio that marker noise causes.
constexpr double kFlatShare = 1e-6;

struct Centres {
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  Eigen::Vector3d to = Eigen::Vector3d::Zero();
  double weight = 0.0;
  int count = 0;
};

Centres centres_of(std::span<const PointPair> pairs) {
  Centres sum;
  for (const PointPair& pair : pairs) {
    if (pair.weight <= 0.0) continue;
    sum.from += pair.weight * pair.from;
    sum.to += pair.weight * pair.to;
    sum.weight += pair.weight;
    ++sum.count;
  }
  if (sum.weight > 0.0) {
    sum.from /= sum.weight;
    sum.to /= sum.weight;
  }
  return sum;
}

}  // namespace

std::optional<RigidFit> fit_rigid(std::span<const PointPair> pairs) {
  const Centres centre = centres_of(pairs);
  if (centre.count < 3) return std::nullopt;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const auto& [from, to, weight] : pairs) {
    if (weight > 0.0) spread += weight * (to - centre.to) * (from - centre.from).transpose();
  }
  if (!spread.allFinite()) return std::nullopt;

  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(spread, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d& values = svd.singularValues();
  if (values[0] <= 0.0 || values[1] < kFlatShare * values[0]) return std::nullopt;
  Eigen::Matrix3d keep_handed = Eigen::Matrix3d::Identity();
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0.0) keep_handed(2, 2) = -1.0;
  const Eigen::Matrix3d rotation = svd.matrixU() * keep_handed * svd.matrixV().transpose();

  RigidFit fit;
  fit.to_from.rotation = Eigen::Quaterniond(rotation).normalized();
  fit.to_from.position = centre.to - fit.to_from.rotation * centre.from;
  double sum_of_squares = 0.0;
  for (const auto& [from, to, weight] : pairs) {
    if (weight > 0.0) sum_of_squares += weight * (fit.to_from * from - to).squaredNorm();
  }
  fit.rms_m = std::sqrt(sum_of_squares / centre.weight);
  return fit;
}

Eigen::Vector3d UprightFit::operator*(const Eigen::Vector3d& from) const {
  const double c = scale * std::cos(yaw_rad);
  const double s = scale * std::sin(yaw_rad);
  return Eigen::Vector3d{c * from.x() - s * from.y(), s * from.x() + c * from.y(), scale * from.z()} + translation;
}

std::optional<UprightFit> fit_upright(std::span<const PointPair> pairs) {
  const Centres centre = centres_of(pairs);
  if (centre.count < 2) return std::nullopt;
  double along = 0.0;
  double across = 0.0;
  double upward = 0.0;
  double size = 0.0;
  for (const auto& [from, to, weight] : pairs) {
    if (weight <= 0.0) continue;
    const Eigen::Vector3d f = from - centre.from;
    const Eigen::Vector3d t = to - centre.to;
    along += weight * (f.x() * t.x() + f.y() * t.y());
    across += weight * (f.x() * t.y() - f.y() * t.x());
    upward += weight * f.z() * t.z();
    size += weight * f.squaredNorm();
  }
  const double turned = std::hypot(along, across);
  if (!(size > 0.0) || !(turned > kFlatShare * size)) return std::nullopt;

  UprightFit fit;
  fit.yaw_rad = std::atan2(across, along);
  fit.scale = (turned + upward) / size;
  if (!(fit.scale > 0.0)) return std::nullopt;
  fit.translation = centre.to - fit * centre.from;
  double sum_of_squares = 0.0;
  for (const auto& [from, to, weight] : pairs) {
    if (weight > 0.0) sum_of_squares += weight * (fit * from - to).squaredNorm();
  }
  fit.rms_m = std::sqrt(sum_of_squares / centre.weight);
  return fit;
}

}  // namespace mocap::geometry
