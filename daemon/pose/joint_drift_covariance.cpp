#include "pose/joint_drift_covariance.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace mocap::pose {
namespace {

// Shorter times without observation are treated as none: a sixth of a set at 120 Hz.
constexpr double kNegligible_s = 0.0015;
// Bound on the accumulated time. kMaxJointDrift_rad is reached after 0.5 s.
constexpr double kMaxUnobserved_s = 10.0;

}  // namespace

JointDriftCovariance::JointDriftCovariance(std::size_t bones) : unobserved_s_(bones, Eigen::Matrix3d::Zero()) {}

void JointDriftCovariance::reset() { std::fill(unobserved_s_.begin(), unobserved_s_.end(), Eigen::Matrix3d::Zero()); }

void JointDriftCovariance::step(std::size_t bone, const Eigen::Matrix3d& observed_fraction, double step_s) {
  Eigen::Matrix3d& unobserved_s = unobserved_s_[bone];
  unobserved_s.diagonal().array() += std::max(0.0, step_s);
  const Eigen::Matrix3d unobserved_fraction = Eigen::Matrix3d::Identity() - observed_fraction;
  unobserved_s = (unobserved_fraction * unobserved_s * unobserved_fraction.transpose()).eval();
  const double total_s = unobserved_s.trace();
  if (!(total_s < kMaxUnobserved_s)) unobserved_s *= kMaxUnobserved_s / total_s;
  if (!unobserved_s.allFinite()) unobserved_s = kMaxUnobserved_s / 3.0 * Eigen::Matrix3d::Identity();
}

Eigen::Matrix3d JointDriftCovariance::prior_information(std::size_t bone, double initial_sigma_rad,
                                                        double ahead_s) const {
  const Eigen::Matrix3d& unobserved_s = unobserved_s_[bone];
  const double aged_sigma_rad = initial_sigma_rad + kJointRandomWalk_rad_s * std::max(0.0, ahead_s);
  if (unobserved_s.trace() < kNegligible_s) {
    const double sigma = std::min(kMaxJointDrift_rad, aged_sigma_rad);
    return Eigen::Matrix3d::Identity() / (sigma * sigma);
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes;
  axes.computeDirect(unobserved_s);
  const Eigen::Array3d sigma =
      (aged_sigma_rad + kJointRandomWalk_rad_s * axes.eigenvalues().array().max(0.0)).min(kMaxJointDrift_rad);
  return axes.eigenvectors() * sigma.square().inverse().matrix().asDiagonal() * axes.eigenvectors().transpose();
}

}  // namespace mocap::pose
