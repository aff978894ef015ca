#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <span>

#include "base/archive.h"
#include "kinematics/tree_equations.h"
#include "model/skeleton.h"
#include "model/transform.h"

namespace mocap::kinematics {

/// Softness of a joint range for identification and tracking: people reach beyond the ranges of the skeleton file by a
/// little, and detected markers have more weight than the range. The larger value (0.3 instead of 0.1 rad) reduced
/// wrong labels of a cartwheel on baseline41 from 79 to 25 and the joint error from 11.7 to 4.9 mm rms (commit
/// ef561fe).
inline constexpr double kRangeSigma_rad = 0.3;

/// Standard deviation of a joint from its rest pose as a fraction of the range of each axis, for joints that no marker
/// observes: a collar bone (20 degrees) stays within 10 degrees. Chosen by hand; not yet measured.
inline constexpr double kRestRangeFraction = 0.5;

/// Prior of a pose: rest pose, joint ranges, and the pose before the fit. All standard deviations are positive.
struct PosePrior {
  double rest_sigma_rad = 3.0;  ///< of a joint from its rest pose
  /// the same as a fraction of the range of each axis; the smaller of both applies; 0: not used
  double rest_range_fraction = 0.0;
  double limit_sigma_rad = 0.1;  ///< of a joint beyond its range
  /// By bone, 0 to 1: factor on the information of the rest pose and of the range, small where markers observe the
  /// joint. Empty: 1 for all bones.
  std::span<const double> rest_confidence{};
  std::span<const double> limit_confidence{};
  std::span<const double> prior_sigma_rad{};  ///< by bone, of a joint from `prior_pose`; empty: no such prior
  /// The same by bone as an information matrix in the parent's frame, 1/rad^2. Replaces `prior_sigma_rad`.
  std::span<const Eigen::Matrix3d> prior_information{};
  double prior_root_sigma_m = 1.0;     ///< of the root's position from `prior_pose`
  std::span<const Pose> prior_pose{};  ///< local poses that are the mean of the prior; empty: the pose before the fit
  double stretch_sigma = 0.08;         ///< of a bone's length, as a fraction of it; only if lengths are free
  double bend_sigma_m = 0.015;         ///< of a bone's rest offset across its length; only if lengths are free
  double outlier_m = 0.05;             ///< scale of the robust cost: a marker farther off has little weight
};

inline bool has_prior_pose(const PosePrior& prior) {
  return !prior.prior_sigma_rad.empty() || !prior.prior_information.empty();
}

/// The plane in which a bone stays while its joint bends (an elbow or a knee), in the parent's frame.
struct SwivelPlane {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();     ///< unit normal of the plane
  Eigen::Vector3d bone_axis = Eigen::Vector3d::Zero();  ///< unit vector along the bone in rest pose
  double weight_1_rad2 = 0.0;  ///< information of the angle between bone and plane; 0: the plane is unknown

  void archive(Archive& members) { members(normal, bone_axis, weight_1_rad2); }
};

/// The prior of one joint during a fit. The three unknowns of a joint are a small rotation that precedes its rotation,
/// in the parent's frame. If some axes are locked, the unknowns are the change of its rotation vector along the free
/// axes.
///
/// The range is a box around the rotation vector. A joint beyond its range is drawn back to it; a locked axis stays at
/// 0. The root has no range.
class JointPrior {
 public:
  JointPrior(const Bone& bone, bool root);

  /// Replaces the axes of range and rest pose: both apply to the product of this matrix and the rotation vector (a
  /// calibrated hinge axis). No effect on a joint with a locked axis.
  void set_hinge_axis(const Eigen::Matrix3d& nominal_from_calibrated);
  /// Adds a prior on the plane in which the bone bends. No effect on a joint with a locked axis.
  void set_swivel_plane(const SwivelPlane& plane);
  /// Takes over the standard deviations of `prior` for this bone.
  void set(const PosePrior& prior, std::size_t bone);
  /// The rotation with the locked components of its rotation vector set to 0.
  Eigen::Quaterniond project_to_free_axes(const Eigen::Quaterniond& local) const;

  /// Returns twice the cost of a rotation, with `prior_rotation` as the mean of the prior. `add`,
  /// `rotation_covariance` and `apply_step` refer to this rotation until the next call.
  double evaluate(const Eigen::Quaterniond& local, const Eigen::Quaterniond& prior_rotation);
  /// Writes information, gradient and axes of the joint's unknowns; `parent` is world_from_parent.
  void add(const Eigen::Matrix3d& parent, JointTerms& into) const;
  /// The covariance of the rotation as a small rotation in the parent's frame, rad^2, from that of the unknowns: none
  /// about a locked axis.
  Eigen::Matrix3d rotation_covariance(const Eigen::Matrix3d& unknowns) const;
  /// The rotation after a step of the unknowns.
  Eigen::Quaterniond apply_step(const Eigen::Quaterniond& local, const Eigen::Vector3d& step) const;

  /// Writes the belief, or takes it over from an object that was built with the same settings (see Archive).
  void archive(Archive& members) {
    members(has_calibrated_axis_, nominal_from_calibrated_, plane_, nominal_rotation_vector_);
  }

 private:
  Eigen::Matrix3d jacobian_of_free_axes() const;

  Eigen::Vector3d min_rad_;
  Eigen::Vector3d max_rad_;
  Eigen::Vector3d free_axes_;  // 1: free axis; 0: locked axis
  bool root_;
  bool has_locked_axis_;  // at least one axis is locked
  Eigen::Vector3d rest_information_ = Eigen::Vector3d::Zero();
  double limit_information_ = 0.0;
  bool has_prior_pose_ = false;
  Eigen::Matrix3d prior_information_ = Eigen::Matrix3d::Zero();
  bool has_calibrated_axis_ = false;
  Eigen::Matrix3d nominal_from_calibrated_ = Eigen::Matrix3d::Identity();
  SwivelPlane plane_;
  Eigen::Vector3d bone_direction_ = Eigen::Vector3d::Zero();           // plane_.bone_axis after the rotation
  Eigen::Vector3d rotation_vector_ = Eigen::Vector3d::Zero();          // of the rotation
  Eigen::Vector3d nominal_rotation_vector_ = Eigen::Vector3d::Zero();  // the rotation vector in the axes of the range
  Eigen::Vector3d range_excess_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d prior_error_ = Eigen::Vector3d::Zero();
};

/// Information matrix, 1/m^2, of a bone's rest offset around the model's: `stretch_sigma` along it, `bend_sigma_m`
/// across.
Eigen::Matrix3d offset_information(const Eigen::Vector3d& model, const PosePrior& prior);

}  // namespace mocap::kinematics
