#include "kinematics/observation.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace mocap::kinematics {
namespace {

// An unusable covariance is replaced by one that leaves the marker anywhere within a metre.
constexpr double kUnknown_m = 1.0;

}  // namespace

Observation observe_point(int marker, const Eigen::Vector3d& position, const Eigen::Matrix3d& covariance_m2,
                          double skin_sigma_m) {
  Observation seen;
  seen.marker = marker;
  seen.position = position;
  Eigen::Matrix3d covariance = 0.5 * (covariance_m2 + covariance_m2.transpose());
  const bool usable = covariance.allFinite() && covariance.diagonal().minCoeff() >= 0.0;
  if (!usable) covariance = kUnknown_m * kUnknown_m * Eigen::Matrix3d::Identity();
  seen.sigma_m = std::hypot(skin_sigma_m, std::sqrt(std::min(covariance.trace() / 3.0, kUnknown_m * kUnknown_m)));
  covariance.diagonal().array() += skin_sigma_m * skin_sigma_m;
  const Eigen::Matrix3d weight = covariance.inverse();
  const bool is_positive_definite = weight.allFinite() && weight.diagonal().minCoeff() > 0.0 &&
                                    weight.trace() <= 3.01 / (skin_sigma_m * skin_sigma_m);
  if (is_positive_definite) seen.weight_1_m2 = weight;
  return seen;
}

Observation observe_ray(int marker, const Eigen::Vector3d& eye, const Eigen::Vector3d& direction, double sigma_rad,
                        const Eigen::Vector3d& near, double skin_sigma_m) {
  Observation seen;
  seen.marker = marker;
  const double depth_m = (near - eye).dot(direction);
  seen.position = eye + depth_m * direction;
  seen.sigma_m = std::hypot(skin_sigma_m, sigma_rad * depth_m);
  seen.weight_1_m2 = (Eigen::Matrix3d::Identity() - direction * direction.transpose()) / (seen.sigma_m * seen.sigma_m);
  seen.bearing_only = true;
  return seen;
}

bool is_usable(const Observation& seen) {
  return seen.position.allFinite() && seen.weight_1_m2.allFinite() && std::isfinite(seen.sigma_m) && seen.sigma_m > 0.0;
}

double distance_m(const Observation& seen, const Eigen::Vector3d& place) {
  const Eigen::Vector3d off = place - seen.position;
  if (!seen.bearing_only) return off.norm();
  return seen.sigma_m * std::sqrt(std::max(0.0, off.dot(seen.weight_1_m2 * off)));
}

double information_1_m2(const Observation& seen) {
  const double trace = seen.weight_1_m2.trace();
  return trace == 0.0 ? 1.0 / (seen.sigma_m * seen.sigma_m) : trace / (seen.bearing_only ? 2.0 : 3.0);
}

}  // namespace mocap::kinematics
