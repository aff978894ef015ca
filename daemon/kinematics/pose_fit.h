#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "kinematics/joint_prior.h"
#include "kinematics/observation.h"
#include "kinematics/tree_equations.h"
#include "model/skeleton.h"
#include "model/transform.h"

namespace mocap::kinematics {

struct PoseFitResult {
  double cost = 0.0;   ///< half the sum of squares, each over its sigma; of markers and priors
  double rms_m = 0.0;  ///< of the markers; rays do not count
  int iterations = 0;
  bool settled = false;  ///< the last step was small
};

/// When a fit is good enough.
struct PoseFitEnd {
  int max_iterations = 20;
  double small_step = 1e-5;  ///< m, rad: no joint moves or turns by more in the last step
};

/// Finds the pose of a skeleton, and on request its bone lengths, that explain where its markers were seen: robust
/// Gauss-Newton with damping over all joints at once, from the pose it has (a warm start).
///
/// Allocates in the constructor only, and where it is shown more observations than markers. The same calls give the
/// same pose, bit by bit. The pose is always finite, its quaternions are of unit length, and axes that do not turn are
/// at 0 after a solve.
class PoseFit {
 public:
  enum class Lengths { Fixed, Free };

  PoseFit(const MarkerSet& set, Lengths lengths);

  const MarkerSet& marker_set() const noexcept { return set_; }
  /// New bone offsets and marker offsets, by bone and by marker; the joints stay turned as they are.
  void refit(std::span<const Eigen::Vector3d> rest_offsets_m, std::span<const Eigen::Vector3d> marker_offsets_m);

  /// A joint's range and rest from now on: of its rotation vector after this turn (see JointPrior).
  void set_hinge_axis(std::size_t bone, const Eigen::Matrix3d& nominal_from_calibrated) {
    joints_[bone].set_hinge_axis(nominal_from_calibrated);
  }
  /// The plane that a bone bends in from now on.
  void set_swivel_plane(std::size_t bone, const SwivelPlane& plane) { joints_[bone].set_swivel_plane(plane); }

  /// The rest pose, bones `scale` times as long, at `world_from_root`.
  void place(const Pose& world_from_root, double scale = 1.0);
  /// A pose by its local poses (of which, but for the root, only the turns are taken).
  void set_locals(std::span<const Pose> locals);

  /// By bone: from the parent's frame, the root's from the world.
  std::span<const Pose> locals() const noexcept { return locals_; }
  std::span<const Pose> world() const noexcept { return world_; }
  /// Where the pose puts a marker.
  Eigen::Vector3d marker_at(std::size_t marker) const;

  /// Moves the pose to what explains the observations best. Observations that are not finite are left out.
  PoseFitResult solve(std::span<const Observation> seen, const PosePrior& prior, const PoseFitEnd& end);
  PoseFitResult solve(std::span<const Observation> seen, const PosePrior& prior, int max_iterations) {
    return solve(seen, prior, PoseFitEnd{.max_iterations = max_iterations});
  }

  /// How surely these observations tell the pose it has, for the covariances; the prior's hold is from that pose. False
  /// when they do not.
  [[nodiscard]] bool compute_covariances(std::span<const Observation> seen, const PosePrior& prior);
  /// By the last `compute_covariances`: of a marker's place and a joint's, m^2, and of a bone's turn in the world,
  /// rad^2.
  Eigen::Matrix3d covariance_of(std::size_t marker) const;
  Eigen::Matrix3d joint_covariance(std::size_t bone) const;
  const Eigen::Matrix3d& rotation_covariance(std::size_t bone) const { return equations_.rotation_covariance(bone); }
  /// Likewise of a bone's turn in its parent, in the parent's frame.
  const Eigen::Matrix3d& local_covariance(std::size_t bone) const { return equations_.joint_rotation_covariance(bone); }

 private:
  // An observation as the pose at hand stands to it.
  struct Residual {
    std::size_t bone = 0;
    Eigen::Vector3d lever = Eigen::Vector3d::Zero();  // from the joint, world
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
  std::vector<Eigen::Matrix3d> world_rotations_;  // the world's rotations
  std::vector<Pose> prior_pose_;                  // locals at the start of a solve
  std::vector<Pose> previous_locals_;             // locals before a step
  std::vector<Eigen::Vector3d> model_places_;     // rest offsets that free lengths are drawn to
  std::vector<Residual> residuals_;               // by observation
  double scale_ = 1.0;
  bool free_lengths_;
};

}  // namespace mocap::kinematics
