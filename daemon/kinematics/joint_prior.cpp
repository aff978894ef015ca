#include "kinematics/joint_prior.h"

#include <algorithm>

#include "kinematics/algebra.h"
#include "kinematics/rotation.h"

namespace mocap::kinematics {
JointPrior::JointPrior(const Bone& bone, bool root) : root_(root), has_locked_axis_(false) {
  for (int axis = 0; axis < 3; ++axis) {
    const auto& limits = bone.rotation_limits[static_cast<std::size_t>(axis)];
    const AngleRange range = limits.value_or(AngleRange{0.0, 0.0});
    min_rad_[axis] = range.min_rad;
    max_rad_[axis] = range.max_rad;
    free_axes_[axis] = root || limits ? 1.0 : 0.0;
    has_locked_axis_ = has_locked_axis_ || free_axes_[axis] == 0.0;
  }
}

void JointPrior::set_hinge_axis(const Eigen::Matrix3d& nominal_from_calibrated) {
  if (has_locked_axis_) return;
  nominal_from_calibrated_ = nominal_from_calibrated;
  has_calibrated_axis_ = !nominal_from_calibrated.isIdentity();
}

void JointPrior::set_swivel_plane(const SwivelPlane& plane) {
  if (!has_locked_axis_) plane_ = plane;
}

void JointPrior::set(const PosePrior& prior, std::size_t bone) {
  has_prior_pose_ = has_prior_pose(prior);
  if (!prior.prior_information.empty()) {
    prior_information_ = prior.prior_information[bone];
  } else if (has_prior_pose_) {
    prior_information_ = Eigen::Matrix3d::Identity() / squared(prior.prior_sigma_rad[bone]);
  }
  const double rest_confidence = prior.rest_confidence.empty() ? 1.0 : prior.rest_confidence[bone];
  limit_information_ =
      (prior.limit_confidence.empty() ? 1.0 : prior.limit_confidence[bone]) / squared(prior.limit_sigma_rad);
  for (int axis = 0; axis < 3; ++axis) {
    rest_information_[axis] = 1.0 / squared(prior.rest_sigma_rad);
    const double largest_rad = std::max({-min_rad_[axis], max_rad_[axis], prior.limit_sigma_rad});
    if (prior.rest_range_fraction > 0.0)
      rest_information_[axis] =
          std::max(rest_information_[axis], 1.0 / squared(prior.rest_range_fraction * largest_rad));
    rest_information_[axis] *= rest_confidence;
  }
}

Eigen::Quaterniond JointPrior::project_to_free_axes(const Eigen::Quaterniond& local) const {
  return has_locked_axis_ ? from_rotation_vector(rotation_vector(local).cwiseProduct(free_axes_)) : local;
}

double JointPrior::evaluate(const Eigen::Quaterniond& local, const Eigen::Quaterniond& prior_rotation) {
  double sum = 0.0;
  if (!root_) {
    rotation_vector_ = rotation_vector(local);
    nominal_rotation_vector_ =
        has_calibrated_axis_ ? Eigen::Vector3d(nominal_from_calibrated_ * rotation_vector_) : rotation_vector_;
    range_excess_ = nominal_rotation_vector_ - nominal_rotation_vector_.cwiseMax(min_rad_).cwiseMin(max_rad_);
    sum +=
        rest_information_.dot(nominal_rotation_vector_.cwiseAbs2()) + limit_information_ * range_excess_.squaredNorm();
    if (plane_.weight_1_rad2 > 0.0) {
      bone_direction_ = local * plane_.bone_axis;
      sum += plane_.weight_1_rad2 * squared(plane_.normal.dot(bone_direction_));
    }
  }
  if (has_prior_pose_) {
    prior_error_ = rotation_vector(local * prior_rotation.conjugate());
    sum += prior_error_.dot(prior_information_ * prior_error_);
  }
  return sum;
}

void JointPrior::add(const Eigen::Matrix3d& parent, JointTerms& into) const {
  into.weight.setZero();
  into.gradient.setZero();
  into.axes = parent;
  if (has_prior_pose_) {
    const Eigen::Matrix3d change = inverse_left_jacobian(prior_error_);
    const Eigen::Matrix3d weighted = prior_information_ * change;
    into.weight.noalias() = change.transpose() * weighted;
    into.gradient.noalias() = weighted.transpose() * prior_error_;
  }
  if (root_) return;
  Eigen::Vector3d by_axis = rest_information_;
  for (int axis = 0; axis < 3; ++axis) by_axis[axis] += range_excess_[axis] == 0.0 ? 0.0 : limit_information_;
  const Eigen::Vector3d gradient =
      rest_information_.cwiseProduct(nominal_rotation_vector_) + limit_information_ * range_excess_;
  if (!has_locked_axis_) {
    const Eigen::Matrix3d inverse_jacobian = inverse_left_jacobian(rotation_vector_);
    const Eigen::Matrix3d change =
        has_calibrated_axis_ ? Eigen::Matrix3d(nominal_from_calibrated_ * inverse_jacobian) : inverse_jacobian;
    into.weight.noalias() += change.transpose() * by_axis.asDiagonal() * change;
    into.gradient.noalias() += change.transpose() * gradient;
    if (!(plane_.weight_1_rad2 > 0.0)) return;
    const Eigen::Vector3d tilt = bone_direction_.cross(plane_.normal);
    into.weight.noalias() += plane_.weight_1_rad2 * tilt * tilt.transpose();
    into.gradient += plane_.weight_1_rad2 * plane_.normal.dot(bone_direction_) * tilt;
    return;
  }
  const Eigen::Matrix3d jacobian = jacobian_of_free_axes();
  into.weight = (jacobian.transpose() * into.weight * jacobian).eval();
  into.gradient = (jacobian.transpose() * into.gradient).eval();
  into.weight.diagonal() += free_axes_.cwiseProduct(by_axis) + (Eigen::Vector3d::Ones() - free_axes_);
  into.gradient += free_axes_.cwiseProduct(gradient);
  into.axes = parent * jacobian;
}

// From the unknowns of a joint with locked axes to a small rotation in the parent's frame.
Eigen::Matrix3d JointPrior::jacobian_of_free_axes() const {
  return left_jacobian(nominal_rotation_vector_) * free_axes_.asDiagonal();
}

Eigen::Matrix3d JointPrior::rotation_covariance(const Eigen::Matrix3d& unknowns) const {
  if (!has_locked_axis_) return unknowns;
  const Eigen::Matrix3d jacobian = jacobian_of_free_axes();
  return jacobian * unknowns * jacobian.transpose();
}

Eigen::Quaterniond JointPrior::apply_step(const Eigen::Quaterniond& local, const Eigen::Vector3d& step) const {
  if (has_locked_axis_) return from_rotation_vector((rotation_vector(local) + step).cwiseProduct(free_axes_));
  return (from_rotation_vector(step) * local).normalized();
}

Eigen::Matrix3d offset_information(const Eigen::Vector3d& model, const PosePrior& prior) {
  const double length = model.norm();
  const double across = 1.0 / squared(prior.bend_sigma_m);
  if (length < 1e-6) return across * Eigen::Matrix3d::Identity();
  const Eigen::Vector3d u = model / length;
  const double along = 1.0 / squared(prior.stretch_sigma * length);
  return across * Eigen::Matrix3d::Identity() + (along - across) * u * u.transpose();
}

}  // namespace mocap::kinematics
