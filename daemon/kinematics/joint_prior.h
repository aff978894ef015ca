#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <span>

#include "kinematics/tree_equations.h"
#include "model/skeleton.h"
#include "model/transform.h"

namespace mocap::kinematics {

/// What is taken for true where no marker tells otherwise.
struct PosePrior {
  double rest_sigma_rad = 3.0;       ///< of a joint from its rest pose
  double rest_range_fraction = 0.0;  ///< the same as a share of each axis's range, where that is less; 0: not so
  double limit_sigma_rad = 0.1;      ///< of a joint beyond its range
  /// By bone, 0 to 1: how much of them is believed where markers tell better; empty: all.
  std::span<const double> rest_confidence{};
  std::span<const double> limit_confidence{};
  std::span<const double> prior_sigma_rad{};  ///< by bone, from where it was before the call; empty: not held
  /// The same as one over the covariance in the parent's frame, 1/rad^2, and instead of it.
  std::span<const Eigen::Matrix3d> prior_information{};
  double prior_root_sigma_m = 1.0;     ///< of the root's place, likewise
  std::span<const Pose> prior_pose{};  ///< locals that it is all held to; empty: those from before the call
  double stretch_sigma = 0.08;         ///< of a bone's length, share of it; only when lengths are free
  double bend_sigma_m = 0.015;         ///< of a bone's offset across its length; likewise
  double outlier_m = 0.05;             ///< a marker further off than this counts less and less
};

inline bool has_prior_pose(const PosePrior& prior) {
  return !prior.prior_sigma_rad.empty() || !prior.prior_information.empty();
}

/// The plane that a bone stays in while its joint bends, in its parent's frame: an elbow's or a knee's.
struct SwivelPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();     ///< unit, normal to it
  Eigen::Vector3d bone_axis = Eigen::Vector3d::Zero();  ///< unit, along the bone at rest
  double weight_1_rad2 = 0.0;  ///< one over the variance of the bone's angle to it; 0: not known
};

/// One joint's prior during a fit. The joint's unknown is a small turn before its own, in its parent's frame; where
/// some axes do not turn, the change of its rotation vector along those that do.
///
/// Limits are a box around the rotation vector; beyond, a joint is drawn back, and an axis that does not turn stays at
/// 0 for good. The root is free.
class JointPrior {
 public:
  JointPrior(const Bone& bone, bool root);

  /// From now on the turn's rotation vector stands in the box after this turn of it: an elbow's axis that leans. Not
  /// for joints with an axis that does not turn.
  void set_hinge_axis(const Eigen::Matrix3d& nominal_from_calibrated);
  /// From now on the bone bends in this plane, whatever else is believed. Not for joints with an axis that does not
  /// turn.
  void set_swivel_plane(const SwivelPlane& plane);
  /// Takes in how strong it is.
  void set(const PosePrior& prior, std::size_t bone);
  /// The nearest turn that its locked axes allow.
  Eigen::Quaterniond project_to_free_axes(const Eigen::Quaterniond& local) const;

  /// Twice the cost of a turn, held to `prior_rotation`; `add` and `apply_step` are for this turn from then on.
  double evaluate(const Eigen::Quaterniond& local, const Eigen::Quaterniond& prior_rotation);
  /// Weight, pull and axes of the joint's unknowns; `parent` is the world's from the parent's frame.
  void add(const Eigen::Matrix3d& parent, JointTerms& into) const;
  /// The turn after a step.
  Eigen::Quaterniond apply_step(const Eigen::Quaterniond& local, const Eigen::Vector3d& step) const;

 private:
  Eigen::Vector3d min_rad_;
  Eigen::Vector3d max_rad_;
  Eigen::Vector3d free_axes_;  // 1: the axis turns; 0: it stays
  bool root_;
  bool has_locked_axis_;  // an axis stays
  Eigen::Vector3d rest_information_ = Eigen::Vector3d::Zero();
  double limit_information_ = 0.0;
  bool has_prior_pose_ = false;
  Eigen::Matrix3d prior_information_ = Eigen::Matrix3d::Zero();
  bool has_calibrated_axis_ = false;
  Eigen::Matrix3d nominal_from_calibrated_ = Eigen::Matrix3d::Identity();
  SwivelPlane plane_;
  Eigen::Vector3d bone_direction_ = Eigen::Vector3d::Zero();           // the plane's, turned
  Eigen::Vector3d rotation_vector_ = Eigen::Vector3d::Zero();          // the turn's rotation vector
  Eigen::Vector3d nominal_rotation_vector_ = Eigen::Vector3d::Zero();  // the same as it stands in the box
  Eigen::Vector3d range_excess_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d prior_error_ = Eigen::Vector3d::Zero();
};

/// The information, 1/m^2, of a bone's place about its model's: along it by its stretch, across by its bend.
Eigen::Matrix3d offset_information(const Eigen::Vector3d& model, const PosePrior& prior);

}  // namespace mocap::kinematics
