#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "model/transform.h"
#include "pose/smooth_settings.h"

namespace mocap::pose {

/// Takes the trembling out of a pose: a low-pass of first order on the root's place and on each joint's turn, whose
/// cut-off rises with speed, so that what is at rest is still and what is quick is not late.
///
/// Allocates in the constructor only.
///
/// Source: Casiez, Roussel, Vogel, "1 Euro filter" (2012), with turns for numbers.
class PoseSmoother {
 public:
  PoseSmoother(const SmoothSettings& settings, std::size_t bones);

  bool is_enabled() const noexcept { return settings_.min_cutoff_hz > 0.0; }
  /// The next pose is shown as it is.
  void reset() { fresh_ = true; }

  /// One instant, `step_s` after the last. Gives what is to be shown.
  std::span<const Pose> step(std::span<const Pose> locals, double step_s);

  /// By how much the last pose is late, s: 1 / (2 pi cut-off), the mean over the root's place and all turns.
  double delay_s() const noexcept { return is_enabled() ? delay_s_ : 0.0; }

 private:
  // The share of the new value, from how much is to be made up and how fast it went.
  double smoothing_gain(const Eigen::Vector3d& raw_step, double step_s, Eigen::Vector3d& speed);

  SmoothSettings settings_;
  bool fresh_ = true;
  double delay_s_ = 0.0;
  std::vector<Pose> shown_;
  std::vector<Pose> raw_;  // of the last instant
  std::vector<Eigen::Vector3d> angular_velocities_rad_s_;
  Eigen::Vector3d velocity_m_s_ = Eigen::Vector3d::Zero();
};

}  // namespace mocap::pose
