#include "pose/running_mean_rotation.h"

#include <algorithm>

#include "kinematics/rotation.h"

namespace mocap::pose {
namespace {

// A mean over so long, with weights that die away.
constexpr double kOver_s = 1.0;
// Markers that tell two of a joint's turns tell nearly how it is turned: about itself a limb turns little.
constexpr double kTold = 2.0;

}  // namespace

void UsualTurns::reset() { std::fill(bones_.begin(), bones_.end(), Usual{}); }

void UsualTurns::learn(std::size_t bone, const Eigen::Quaterniond& local, const Eigen::Matrix3d& share, double step_s) {
  if (!(step_s > 0.0) || !(share.trace() > kTold)) return;
  Usual& usual = bones_[bone];
  if (usual.seen_s == 0.0) usual.local = local;
  usual.seen_s = std::min(kOver_s, usual.seen_s + step_s);
  const double weight = std::min(1.0, step_s / usual.seen_s);
  usual.local = (kinematics::turn_by(weight * kinematics::rotation_vector(local * usual.local.conjugate())) * usual.local).normalized();
}

Eigen::Vector3d UsualTurns::turn_from(std::size_t bone, const Eigen::Quaterniond& local) const {
  if (!known(bone)) return Eigen::Vector3d::Zero();
  return kinematics::rotation_vector(bones_[bone].local * local.conjugate());
}

}  // namespace mocap::pose
