#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "base/archive.h"
#include "kinematics/joint_prior.h"
#include "kinematics/observation.h"
#include "kinematics/tree_equations.h"
#include "model/skeleton.h"
#include "model/transform.h"

namespace mocap::kinematics {

struct PoseFitResult {
  double cost = 0.0;   ///< half the sum of squared normalised residuals, of markers and priors
  double rms_m = 0.0;  ///< of the marker positions; bearing-only and ambiguous observations are excluded
  int iterations = 0;
  bool converged = false;  ///< the last step was small

  void archive(Archive& members) { members(cost, rms_m, iterations, converged); }
};

/// Levenberg-Marquardt damping of a pose fit: the initial and smallest value, and the value above which the fit stops.
/// A rejected step multiplies the damping by 10, an accepted one by 0.1. Chosen by hand; not yet measured.
inline constexpr double kInitialDamping = 1e-6;
inline constexpr double kMaxDamping = 1e3;

/// When a fit stops.
struct PoseFitEnd {
  int max_iterations = 20;
  double small_step = 1e-5;  ///< m, rad: no joint moves or rotates by more in the last step
};

/// Finds the maximum a posteriori pose of a skeleton from observations of its markers, and on request its bone lengths.
/// Robust Levenberg-Marquardt over all joints at once, from the current pose (warm start). Robust weights are updated
/// in each step (iteratively reweighted least squares) with the cost of Geman and McClure.
///
/// Allocates in the constructor only, and in a call with more observations than markers. Equal calls give bitwise equal
/// poses. The pose is always finite, its quaternions have unit length, and locked axes are at 0 after a solve.
///
/// Source: Geman and McClure, Statistical methods for tomographic image reconstruction (1987), for the robust cost;
/// Triggs et al., Bundle Adjustment - A Modern Synthesis (2000), section 4, for damped Gauss-Newton steps. The
/// equations are solved by TreeEquations.
class PoseFit {
 public:
  enum class Lengths { Fixed, Free };

  PoseFit(const MarkerSet& set, Lengths lengths);

  const MarkerSet& marker_set() const noexcept { return set_; }
  /// Takes over fitted bone offsets and marker offsets, by bone and by marker. Joint rotations stay.
  void refit(std::span<const Eigen::Vector3d> rest_offsets_m, std::span<const Eigen::Vector3d> marker_offsets_m);

  /// Sets the axes of a joint's range and rest pose (see JointPrior::set_hinge_axis).
  void set_hinge_axis(std::size_t bone, const Eigen::Matrix3d& nominal_from_calibrated) {
    joints_[bone].set_hinge_axis(nominal_from_calibrated);
  }
  /// Sets the plane in which a bone bends (see JointPrior::set_swivel_plane).
  void set_swivel_plane(std::size_t bone, const SwivelPlane& plane) { joints_[bone].set_swivel_plane(plane); }

  /// Sets the rest pose at `world_from_root`, with all bones scaled by `scale`.
  void place(const Pose& world_from_root, double scale = 1.0);
  /// Sets the pose. Of all bones but the root only the rotation is used.
  void set_locals(std::span<const Pose> locals);

  /// By bone, in the parent's frame; of the root in the world frame.
  std::span<const Pose> locals() const noexcept { return locals_; }
  std::span<const Pose> world() const noexcept { return world_; }
  /// Position of a marker in the current pose.
  Eigen::Vector3d marker_at(std::size_t marker) const;

  /// Optimises the pose. Observations that are not usable (is_usable) are left out.
  PoseFitResult solve(std::span<const Observation> seen, const PosePrior& prior, const PoseFitEnd& end);
  PoseFitResult solve(std::span<const Observation> seen, const PosePrior& prior, int max_iterations) {
    return solve(seen, prior, PoseFitEnd{.max_iterations = max_iterations});
  }

  /// Prepares the covariances of the current pose, given these observations and the prior around the current pose.
  /// False if the equations are singular.
  [[nodiscard]] bool compute_covariances(std::span<const Observation> seen, const PosePrior& prior);
  /// By the last `compute_covariances`: of a marker's position and of a joint's position, m^2, and of a bone's rotation
  /// in the world frame, rad^2.
  Eigen::Matrix3d covariance_of(std::size_t marker) const;
  Eigen::Matrix3d joint_covariance(std::size_t bone) const;
  const Eigen::Matrix3d& rotation_covariance(std::size_t bone) const { return equations_.rotation_covariance(bone); }
  /// By the last `compute_covariances`: of a bone's rotation relative to its parent, in the parent's frame, rad^2.
  Eigen::Matrix3d local_covariance(std::size_t bone) const {
    return joints_[bone].rotation_covariance(equations_.joint_rotation_covariance(bone));
  }

  /// Writes the belief, or takes it over from an object that was built with the same settings (see Archive).
  void archive(Archive& members);

 private:
  // Residual of one observation in the current pose.
  struct Residual {
    std::size_t bone = 0;
    Eigen::Vector3d lever = Eigen::Vector3d::Zero();  // from the joint, world frame
    Eigen::Vector3d error = Eigen::Vector3d::Zero();
    double robust_weight = 1.0;
  };

  void update_world();
  void begin(std::span<const Observation> seen, const PosePrior& prior);
  double evaluate(std::span<const Observation> seen, const PosePrior& prior);
  double evaluate(const Observation& seen, double outlier_m, Residual& into) const;
  void assemble(std::span<const Observation> seen, const PosePrior& prior);
  void step();
  bool step_is_small(double small) const;
  double rms_of(std::span<const Observation> seen) const;

  MarkerSet set_;
  std::vector<int> parents_;
  std::vector<JointPrior> joints_;
  TreeEquations equations_;
  std::vector<Pose> locals_;
  std::vector<Pose> world_;
  std::vector<Eigen::Matrix3d> world_rotations_;  // of world_
  std::vector<Pose> prior_pose_;                  // locals at the start of a solve, or those of the prior
  std::vector<Pose> previous_locals_;             // locals before a step
  std::vector<Eigen::Vector3d> model_offsets_;    // mean of the prior of free bone lengths
  std::vector<Residual> residuals_;               // by observation
  double scale_ = 1.0;
  bool free_lengths_;
};

}  // namespace mocap::kinematics
