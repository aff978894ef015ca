#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace mocap::pose {

/// For how long which turns of each joint have been hidden: one marker on a hand tells how the hand points, and nothing
/// of its turn about that line, which may have gone on since another marker told it.
///
/// Allocates in the constructor only.
class JointDriftCovariance {
 public:
  explicit JointDriftCovariance(std::size_t bones);

  /// All turns are told now.
  void reset();
  /// Time goes on by `step_s`, at the end of which markers tell `observed_fraction` of the bone's turn in its parent's
  /// frame: 1 along an axis that they tell alone, 0 along one that they tell nothing of.
  void step(std::size_t bone, const Eigen::Matrix3d& observed_fraction, double step_s);

  /// One over the covariance, 1/rad^2, of where the bone has turned meanwhile, by `ahead_s` after the last step; what
  /// was told just now is unsure by `initial_sigma_rad`.
  Eigen::Matrix3d prior_information(std::size_t bone, double initial_sigma_rad, double ahead_s) const;

 private:
  std::vector<Eigen::Matrix3d> unobserved_s_;  // in the parent's frame: how long, by axis
};

/// How fast a hidden joint leaves the way that it was on; and no further than anybody knows no more, rad.
inline constexpr double kJointRandomWalk_rad_s = 2.5;
inline constexpr double kMaxJointDrift_rad = 1.2;

}  // namespace mocap::pose
