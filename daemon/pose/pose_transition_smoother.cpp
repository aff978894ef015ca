#include "pose/pose_transition_smoother.h"

#include <algorithm>
#include <cmath>

#include "base/expects.h"
#include "kinematics/rotation.h"

namespace mocap::pose {
namespace {

// Of the spring: a person who watches takes 0.1 to 0.2 s for one movement.
constexpr double kFade_s = 0.04;
// What the motion commonly leads astray by is told over this time; what goes beyond three times that and these floors,
// which no eye sees, is a jump.
constexpr double kUsual_s = 0.3;
constexpr double kUsuals = 3.0;
constexpr double kLeastTurn_rad = 0.002;
constexpr double kLeastMove_m = 0.0005;

}  // namespace

PoseEaser::PoseEaser(std::size_t bones) : turns_(bones), shown_(bones) {}

void PoseEaser::reset() {
  std::fill(turns_.begin(), turns_.end(), Fading{});
  root_ = {};
}

// x'' = -2 x' / t - x / t^2, exactly.
void PoseEaser::Fading::fade(double step_s) {
  const double share = std::exp(-step_s / kFade_s);
  const Eigen::Vector3d moving = rate_1_s + left / kFade_s;
  left = share * (left + step_s * moving);
  rate_1_s = share * (rate_1_s - step_s / kFade_s * moving);
}

void PoseEaser::Fading::meet(const Eigen::Vector3d& astray, const Eigen::Vector3d& behind, bool changed, double least,
                             double step_s) {
  const double size = astray.norm();
  const double most = least + kUsuals * std::sqrt(usual2);
  if (changed && size > most) {
    left += astray;
    if (behind.norm() < left.norm()) {
      left = behind;
      rate_1_s.setZero();
    }
  } else {
    usual2 += std::min(1.0, step_s / kUsual_s) * (size * size - usual2);
  }
}

std::span<const Pose> PoseEaser::step(std::span<const Pose> poses, std::span<const Pose> foreseen,
                                      std::span<const std::uint8_t> changed, double step_s) {
  MOCAP_EXPECTS(poses.size() == shown_.size() && foreseen.size() == poses.size() && changed.size() == poses.size());
  root_.fade(step_s);
  const Eigen::Vector3d behind_m = shown_[0].position - poses[0].position;
  for (std::size_t b = 0; b < shown_.size(); ++b) {
    Fading& turn = turns_[b];
    turn.fade(step_s);
    const Eigen::Vector3d astray = kinematics::rotation_vector(foreseen[b].rotation * poses[b].rotation.conjugate());
    const Eigen::Vector3d behind = kinematics::rotation_vector(shown_[b].rotation * poses[b].rotation.conjugate());
    turn.meet(astray, behind, changed[b] != 0, kLeastTurn_rad, step_s);
    shown_[b].position = poses[b].position;
    shown_[b].rotation = (kinematics::turn_by(turn.left) * poses[b].rotation).normalized();
  }
  root_.meet(foreseen[0].position - poses[0].position, behind_m, changed[0] != 0, kLeastMove_m, step_s);
  shown_[0].position += root_.left;
  return shown_;
}

}  // namespace mocap::pose
