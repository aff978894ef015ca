#include "pose/pose_transition_smoother.h"

#include <algorithm>
#include <cmath>

#include "base/expects.h"
#include "kinematics/rotation.h"

namespace mocap::pose {
namespace {

// Time constant of the spring: 90 % of the offset decays in 3.9 time constants (0.16 s). Chosen by hand for a movement
// of 0.1 to 0.2 s that looks natural; not yet measured.
constexpr double kDecay_s = 0.04;
// A jump is a prediction error above kJumpSigmas times the rms error of the last kMeanSquareWindow_s, plus a floor
// below what is visible. Chosen by hand; not yet measured.
constexpr double kMeanSquareWindow_s = 0.3;
constexpr double kJumpSigmas = 3.0;
constexpr double kMinJump_rad = 0.002;
constexpr double kMinJump_m = 0.0005;

}  // namespace

PoseTransitionSmoother::PoseTransitionSmoother(std::size_t bones) : joint_offsets_(bones), shown_(bones) {}

void PoseTransitionSmoother::reset() {
  std::fill(joint_offsets_.begin(), joint_offsets_.end(), DecayingOffset{});
  root_offset_ = {};
}

// The exact solution of x'' = -2 x' / t - x / t^2.
void PoseTransitionSmoother::DecayingOffset::decay(double step_s) {
  const double decay_factor = std::exp(-step_s / kDecay_s);
  const Eigen::Vector3d moving = rate_1_s + offset / kDecay_s;
  offset = decay_factor * (offset + step_s * moving);
  rate_1_s = decay_factor * (rate_1_s - step_s / kDecay_s * moving);
}

void PoseTransitionSmoother::DecayingOffset::absorb_jump(const Eigen::Vector3d& prediction_error,
                                                         const Eigen::Vector3d& display_error, bool changed,
                                                         double min_jump, double step_s) {
  const double size = prediction_error.norm();
  const double max_jump = min_jump + kJumpSigmas * std::sqrt(mean_square);
  if (changed && size > max_jump) {
    offset += prediction_error;
    if (display_error.norm() < offset.norm()) {
      offset = display_error;
      rate_1_s.setZero();
    }
  } else {
    mean_square += std::min(1.0, step_s / kMeanSquareWindow_s) * (size * size - mean_square);
  }
}

std::span<const Pose> PoseTransitionSmoother::step(std::span<const Pose> poses, std::span<const Pose> predicted,
                                                   std::span<const std::uint8_t> changed, double step_s) {
  MOCAP_EXPECTS(poses.size() == shown_.size() && predicted.size() == poses.size() && changed.size() == poses.size());
  root_offset_.decay(step_s);
  const Eigen::Vector3d root_display_error_m = shown_[0].position - poses[0].position;
  for (std::size_t b = 0; b < shown_.size(); ++b) {
    DecayingOffset& joint_offset = joint_offsets_[b];
    joint_offset.decay(step_s);
    const Eigen::Vector3d prediction_error =
        kinematics::rotation_vector(predicted[b].rotation * poses[b].rotation.conjugate());
    const Eigen::Vector3d display_error =
        kinematics::rotation_vector(shown_[b].rotation * poses[b].rotation.conjugate());
    joint_offset.absorb_jump(prediction_error, display_error, changed[b] != 0, kMinJump_rad, step_s);
    shown_[b].position = poses[b].position;
    shown_[b].rotation = (kinematics::from_rotation_vector(joint_offset.offset) * poses[b].rotation).normalized();
  }
  root_offset_.absorb_jump(predicted[0].position - poses[0].position, root_display_error_m, changed[0] != 0, kMinJump_m,
                           step_s);
  shown_[0].position += root_offset_.offset;
  return shown_;
}

}  // namespace mocap::pose
