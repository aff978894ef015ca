#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "base/archive.h"

namespace mocap::pose {

/// Covariance of joint rotations that no marker observes. Each rotation axis has its own random walk: one marker on a
/// hand observes its pointing direction (swing), while the rotation about that direction (twist) may have drifted since
/// another marker observed it. The standard deviation grows linearly with the time without observation, up to
/// kMaxJointDrift_rad.
///
/// Allocates in the constructor only.
class JointDriftCovariance {
 public:
  explicit JointDriftCovariance(std::size_t bones);

  /// All rotations are observed now.
  void reset();
  /// Advances time by `step_s`. At its end markers observe `observed_fraction` of the bone's rotation in the parent's
  /// frame: 1 along an axis that they determine alone, 0 along an unobserved one.
  void step(std::size_t bone, const Eigen::Matrix3d& observed_fraction, double step_s);

  /// Information matrix, 1/rad^2, of a bone's rotation in the parent's frame, `ahead_s` after the last step. A rotation
  /// observed just now has the standard deviation `initial_sigma_rad`.
  Eigen::Matrix3d prior_information(std::size_t bone, double initial_sigma_rad, double ahead_s) const;

  /// Writes the belief, or takes it over from an object that was built with the same settings (see Archive).
  void archive(Archive& members) { members(unobserved_s_); }

 private:
  std::vector<Eigen::Matrix3d> unobserved_s_;  // time without observation as a symmetric matrix in the parent's frame
};

/// Growth of the standard deviation of an unobserved joint rotation, and its bound. Chosen by hand; not yet measured.
inline constexpr double kJointRandomWalk_rad_s = 2.5;
inline constexpr double kMaxJointDrift_rad = 1.2;

}  // namespace mocap::pose
