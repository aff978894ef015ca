#include "pose/joint_drift_covariance.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace mocap::pose {
namespace {

// Less than that is nothing to speak of: a sixth of a set at 120 Hz.
constexpr double kNoTime_s = 0.0015;
// Nothing grows any more.
constexpr double kLong_s = 10.0;

}  // namespace

HiddenTurns::HiddenTurns(std::size_t bones) : hidden_s_(bones, Eigen::Matrix3d::Zero()) {}

void HiddenTurns::reset() { std::fill(hidden_s_.begin(), hidden_s_.end(), Eigen::Matrix3d::Zero()); }

void HiddenTurns::step(std::size_t bone, const Eigen::Matrix3d& share, double step_s) {
  Eigen::Matrix3d& hidden_s = hidden_s_[bone];
  hidden_s.diagonal().array() += std::max(0.0, step_s);
  const Eigen::Matrix3d untold = Eigen::Matrix3d::Identity() - share;
  hidden_s = (untold * hidden_s * untold.transpose()).eval();
  const double all_s = hidden_s.trace();
  if (!(all_s < kLong_s)) hidden_s *= kLong_s / all_s;
  if (!hidden_s.allFinite()) hidden_s = kLong_s / 3.0 * Eigen::Matrix3d::Identity();
}

Eigen::Matrix3d HiddenTurns::hold_weight(std::size_t bone, double least_rad, double ahead_s) const {
  const Eigen::Matrix3d& hidden_s = hidden_s_[bone];
  const double at_least = least_rad + kStray_rad_s * std::max(0.0, ahead_s);
  if (hidden_s.trace() < kNoTime_s) {
    const double sigma = std::min(kMostStray_rad, at_least);
    return Eigen::Matrix3d::Identity() / (sigma * sigma);
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes;
  axes.computeDirect(hidden_s);
  const Eigen::Array3d sigma = (at_least + kStray_rad_s * axes.eigenvalues().array().max(0.0)).min(kMostStray_rad);
  return axes.eigenvectors() * sigma.square().inverse().matrix().asDiagonal() * axes.eigenvectors().transpose();
}

}  // namespace mocap::pose
