#include "kinematics/joint_prior.h"

#include <algorithm>

#include "kinematics/rotation.h"

namespace mocap::kinematics {
namespace {

double squared(double x) { return x * x; }

}  // namespace

JointPrior::JointPrior(const Bone& bone, bool root) : root_(root), locked_(false) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto& turns = bone.turns[static_cast<std::size_t>(axis)];
    const AngleRange range = turns.value_or(AngleRange{0.0, 0.0});
    least_[axis] = range.min_rad;
    most_[axis] = range.max_rad;
    free_[axis] = root || turns ? 1.0 : 0.0;
    locked_ = locked_ || free_[axis] == 0.0;
  }
}

void JointPrior::lean(const Eigen::Matrix3d& as_in_file) {
  if (locked_) return;
  as_in_file_ = as_in_file;
  leans_ = !as_in_file.isIdentity();
}

void JointPrior::bend_in(const BendingPlane& plane) {
  if (!locked_) plane_ = plane;
}

void JointPrior::set(const PosePrior& prior, std::size_t bone) {
  held_ = holds(prior);
  if (!prior.hold_weight.empty()) {
    hold_ = prior.hold_weight[bone];
  } else if (held_) {
    hold_ = Eigen::Matrix3d::Identity() / squared(prior.hold_sigma_rad[bone]);
  }
  const double share = prior.rest_believed.empty() ? 1.0 : prior.rest_believed[bone];
  limit_ = (prior.limit_believed.empty() ? 1.0 : prior.limit_believed[bone]) / squared(prior.limit_sigma_rad);
  for (int axis = 0; axis < 3; ++axis) {
    rest_[axis] = 1.0 / squared(prior.rest_sigma_rad);
    const double widest = std::max({-least_[axis], most_[axis], prior.limit_sigma_rad});
    if (prior.rest_share > 0.0) rest_[axis] = std::max(rest_[axis], 1.0 / squared(prior.rest_share * widest));
    rest_[axis] *= share;
  }
}

Eigen::Quaterniond JointPrior::allowed(const Eigen::Quaterniond& local) const {
  return locked_ ? turn_by(rotation_vector(local).cwiseProduct(free_)) : local;
}

double JointPrior::evaluate(const Eigen::Quaterniond& local, const Eigen::Quaterniond& held) {
  double sum = 0.0;
  if (!root_) {
    turned_ = rotation_vector(local);
    phi_ = leans_ ? Eigen::Vector3d(as_in_file_ * turned_) : turned_;
    beyond_ = phi_ - phi_.cwiseMax(least_).cwiseMin(most_);
    sum += rest_.dot(phi_.cwiseAbs2()) + limit_ * beyond_.squaredNorm();
    if (plane_.weight_1_rad2 > 0.0) {
      along_ = local * plane_.along;
      sum += plane_.weight_1_rad2 * squared(plane_.across.dot(along_));
    }
  }
  if (held_) {
    off_hold_ = rotation_vector(local * held.conjugate());
    sum += off_hold_.dot(hold_ * off_hold_);
  }
  return sum;
}

void JointPrior::add(const Eigen::Matrix3d& parent, JointTerms& into) const {
  into.weight.setZero();
  into.pull.setZero();
  into.axes = parent;
  if (held_) {
    const Eigen::Matrix3d change = change_of_rotation_vector(off_hold_);
    const Eigen::Matrix3d weighted = hold_ * change;
    into.weight.noalias() = change.transpose() * weighted;
    into.pull.noalias() = weighted.transpose() * off_hold_;
  }
  if (root_) return;
  Eigen::Vector3d by_axis = rest_;
  for (int axis = 0; axis < 3; ++axis) by_axis[axis] += beyond_[axis] == 0.0 ? 0.0 : limit_;
  const Eigen::Vector3d pull = rest_.cwiseProduct(phi_) + limit_ * beyond_;
  if (!locked_) {
    const Eigen::Matrix3d turning = change_of_rotation_vector(turned_);
    const Eigen::Matrix3d change = leans_ ? Eigen::Matrix3d(as_in_file_ * turning) : turning;
    into.weight.noalias() += change.transpose() * by_axis.asDiagonal() * change;
    into.pull.noalias() += change.transpose() * pull;
    if (!(plane_.weight_1_rad2 > 0.0)) return;
    const Eigen::Vector3d tilt = along_.cross(plane_.across);
    into.weight.noalias() += plane_.weight_1_rad2 * tilt * tilt.transpose();
    into.pull += plane_.weight_1_rad2 * plane_.across.dot(along_) * tilt;
    return;
  }
  const Eigen::Matrix3d turns = turn_of_changed_vector(phi_) * free_.asDiagonal();
  into.weight = (turns.transpose() * into.weight * turns).eval();
  into.pull = (turns.transpose() * into.pull).eval();
  into.weight.diagonal() += free_.cwiseProduct(by_axis) + (Eigen::Vector3d::Ones() - free_);
  into.pull += free_.cwiseProduct(pull);
  into.axes = parent * turns;
}

Eigen::Quaterniond JointPrior::stepped(const Eigen::Quaterniond& local, const Eigen::Vector3d& step) const {
  if (locked_) return turn_by((rotation_vector(local) + step).cwiseProduct(free_));
  return (turn_by(step) * local).normalized();
}

Eigen::Matrix3d place_weight(const Eigen::Vector3d& model, const PosePrior& prior) {
  const double length = model.norm();
  const double across = 1.0 / squared(prior.bend_sigma_m);
  if (length < 1e-6) return across * Eigen::Matrix3d::Identity();
  const Eigen::Vector3d u = model / length;
  const double along = 1.0 / squared(prior.stretch_sigma * length);
  return across * Eigen::Matrix3d::Identity() + (along - across) * u * u.transpose();
}

}  // namespace mocap::kinematics
