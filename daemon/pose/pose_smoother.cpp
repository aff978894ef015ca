#include "pose/pose_smoother.h"

#include <algorithm>
#include <numbers>

#include "base/expects.h"
#include "kinematics/rotation.h"

namespace mocap::pose {
namespace {

// Cutoff of the speed estimate, the value of the paper (Casiez et al. 2012, section 3).
constexpr double kSpeedCutoff_hz = 1.0;

double low_pass_gain(double cutoff_hz, double step_s) {
  const double w = 2.0 * std::numbers::pi * cutoff_hz * step_s;
  return w / (1.0 + w);
}

}  // namespace

PoseSmoother::PoseSmoother(const SmoothSettings& settings, std::size_t bones)
    : settings_(settings), shown_(bones), raw_(bones), angular_velocities_rad_s_(bones, Eigen::Vector3d::Zero()) {}

double PoseSmoother::smoothing_gain(const Eigen::Vector3d& raw_step, double step_s, Eigen::Vector3d& speed) {
  speed += low_pass_gain(kSpeedCutoff_hz, step_s) * (raw_step / step_s - speed);
  const double cutoff_hz = settings_.min_cutoff_hz + settings_.beta * speed.norm();
  delay_s_ += 1.0 / (2.0 * std::numbers::pi * cutoff_hz);
  return low_pass_gain(cutoff_hz, step_s);
}

std::span<const Pose> PoseSmoother::step(std::span<const Pose> locals, double step_s) {
  MOCAP_EXPECTS(locals.size() == shown_.size());
  delay_s_ = 0.0;
  if (!is_enabled() || fresh_ || !(step_s > 0.0)) {
    std::copy(locals.begin(), locals.end(), shown_.begin());
    if (fresh_) std::fill(angular_velocities_rad_s_.begin(), angular_velocities_rad_s_.end(), Eigen::Vector3d::Zero());
    if (fresh_) velocity_m_s_.setZero();
    fresh_ = false;
  } else {
    for (std::size_t b = 0; b < shown_.size(); ++b) {
      const Eigen::Vector3d raw_step = kinematics::rotation_vector(locals[b].rotation * raw_[b].rotation.conjugate());
      const double gain = smoothing_gain(raw_step, step_s, angular_velocities_rad_s_[b]);
      const Eigen::Vector3d remaining =
          kinematics::rotation_vector(locals[b].rotation * shown_[b].rotation.conjugate());
      shown_[b].rotation = (kinematics::from_rotation_vector(gain * remaining) * shown_[b].rotation).normalized();
      if (b > 0) shown_[b].position = locals[b].position;
    }
    const double gain = smoothing_gain(locals[0].position - raw_[0].position, step_s, velocity_m_s_);
    shown_[0].position += gain * (locals[0].position - shown_[0].position);
    delay_s_ /= static_cast<double>(shown_.size() + 1);
  }
  std::copy(locals.begin(), locals.end(), raw_.begin());
  return shown_;
}

}  // namespace mocap::pose
