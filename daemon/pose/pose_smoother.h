#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "base/archive.h"
#include "model/transform.h"
#include "pose/smooth_settings.h"

namespace mocap::pose {

/// Removes jitter from a pose with a first-order low-pass on the root's position and each joint's rotation. The cutoff
/// frequency rises with speed, so that a body at rest does not tremble and a fast one is not delayed.
///
/// Allocates in the constructor only.
///
/// Source: Casiez, Roussel and Vogel, 1 Euro Filter (2012), applied to rotation vectors.
class PoseSmoother {
 public:
  PoseSmoother(const SmoothSettings& settings, std::size_t bones);

  bool is_enabled() const noexcept { return settings_.min_cutoff_hz > 0.0; }
  /// The next pose is not smoothed.
  void reset() { fresh_ = true; }

  /// Filters one pose, `step_s` after the last. The result is valid until the next call.
  std::span<const Pose> step(std::span<const Pose> locals, double step_s);

  /// Delay of the last pose, s: 1 / (2 pi cutoff), averaged over the root's position and all rotations.
  double delay_s() const noexcept { return is_enabled() ? delay_s_ : 0.0; }

  /// Writes the belief, or takes it over from an object that was built with the same settings (see Archive).
  void archive(Archive& members) { members(fresh_, delay_s_, shown_, raw_, angular_velocities_rad_s_, velocity_m_s_); }

 private:
  // Gain of the low-pass; updates the filtered speed and adds to delay_s_.
  double smoothing_gain(const Eigen::Vector3d& raw_step, double step_s, Eigen::Vector3d& speed);

  SmoothSettings settings_;
  bool fresh_ = true;
  double delay_s_ = 0.0;
  std::vector<Pose> shown_;
  std::vector<Pose> raw_;  // unfiltered poses of the last step
  std::vector<Eigen::Vector3d> angular_velocities_rad_s_;
  Eigen::Vector3d velocity_m_s_ = Eigen::Vector3d::Zero();
};

}  // namespace mocap::pose
