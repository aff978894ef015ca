#include "pose/running_mean_rotation.h"

#include <algorithm>

#include "kinematics/rotation.h"

namespace mocap::pose {
namespace {

// Averaging time, with exponential weights. Chosen by hand; not yet measured.
constexpr double kMeanWindow_s = 1.0;
// Minimum trace of the observed fraction: two observed axes suffice, because limbs twist little. Chosen by hand; not
// yet measured.
constexpr double kMinObservedTrace = 2.0;

}  // namespace

void RunningMeanRotation::reset() { std::fill(bones_.begin(), bones_.end(), Mean{}); }

void RunningMeanRotation::update(std::size_t bone, const Eigen::Quaterniond& local,
                                 const Eigen::Matrix3d& observed_fraction, double step_s) {
  if (!(step_s > 0.0) || !(observed_fraction.trace() > kMinObservedTrace)) return;
  Mean& mean = bones_[bone];
  if (mean.observed_s == 0.0) mean.local = local;
  mean.observed_s = std::min(kMeanWindow_s, mean.observed_s + step_s);
  const double weight = std::min(1.0, step_s / mean.observed_s);
  mean.local = (kinematics::from_rotation_vector(weight * kinematics::rotation_vector(local * mean.local.conjugate())) *
                mean.local)
                   .normalized();
}

Eigen::Vector3d RunningMeanRotation::rotation_to_mean(std::size_t bone, const Eigen::Quaterniond& local) const {
  if (!known(bone)) return Eigen::Vector3d::Zero();
  return kinematics::rotation_vector(bones_[bone].local * local.conjugate());
}

}  // namespace mocap::pose
