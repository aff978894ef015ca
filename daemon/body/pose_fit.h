#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "body/tree_equations.h"
#include "model/skeleton.h"
#include "model/transform.h"

namespace mocap::body {

/// Where one marker of the set was seen.
struct Observation {
  int marker = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m, world
  double sigma_m = 0.005;                              ///< of the measurement and of the skin under it
};

/// What is taken for true where no marker tells otherwise.
struct PosePrior {
  double rest_sigma_rad = 3.0;   ///< of a joint from its rest pose
  double rest_share = 0.0;       ///< the same as a share of each axis's range, where that is less; 0: not so
  double limit_sigma_rad = 0.1;  ///< of a joint beyond its range
  std::span<const double> hold_sigma_rad{};  ///< by bone, from where it was before the call; empty: not held
  double hold_root_sigma_m = 1.0;            ///< of the root's place, likewise
  double stretch_sigma = 0.08;               ///< of a bone's length, share of it; only when lengths are free
  double bend_sigma_m = 0.015;               ///< of a bone's offset across its length; likewise
  double outlier_m = 0.05;                   ///< a marker further off than this counts less and less
};

struct PoseFitResult {
  double cost = 0.0;   ///< half the sum of squares, each over its sigma; of markers and priors
  double rms_m = 0.0;  ///< of the markers
  int iterations = 0;
  bool settled = false;  ///< the last step was small
};

/// Finds the pose of a skeleton, and on request its bone lengths, that explain where its markers were seen: robust
/// Gauss-Newton with damping over all joints at once, from the pose it has (a warm start).
///
/// Allocates in the constructor only. The same calls give the same pose, bit by bit. The pose is always finite and
/// its quaternions are of unit length.
class PoseFit {
 public:
  enum class Lengths { Fixed, Free };

  PoseFit(const MarkerSet& set, Lengths lengths);

  const MarkerSet& marker_set() const noexcept { return set_; }
  /// New bone offsets and marker offsets, by bone and by marker; the joints stay turned as they are.
  void refit(std::span<const Eigen::Vector3d> rest_offsets_m, std::span<const Eigen::Vector3d> marker_offsets_m);

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
  PoseFitResult solve(std::span<const Observation> seen, const PosePrior& prior, int max_iterations);

  /// How surely these observations tell the pose it has, for `covariance_of`; the prior's hold is from that pose. False
  /// when they do not.
  [[nodiscard]] bool weigh(std::span<const Observation> seen, const PosePrior& prior);
  /// Of a marker's place, m^2, by the last `weigh`.
  Eigen::Matrix3d covariance_of(std::size_t marker);

 private:
  struct Chain {
    std::vector<int> unknowns;  // of a bone, from the root down
    std::vector<int> bones;     // whose unknown each is
  };

  void update_world();
  double cost_of(std::span<const Observation> seen, const PosePrior& prior) const;
  void add_all(std::span<const Observation> seen, const PosePrior& prior);
  void add_marker(const Observation& seen, const PosePrior& prior);
  void fill_columns(const Chain& chain, const Eigen::Vector3d& point);
  void add_rotation_prior(std::size_t bone, const PosePrior& prior);
  void add_place_prior(std::size_t bone, const PosePrior& prior);
  void add_block(std::size_t first_unknown, const Eigen::Matrix3d& weight, const Eigen::Vector3d& gradient,
                 std::size_t bone);
  void step(std::span<const double> by);
  const Eigen::Quaterniond& parent_rotation(std::size_t bone) const;
  double rms_of(std::span<const Observation> seen) const;

  MarkerSet set_;
  std::vector<int> place_unknown_;  // first of three of a bone, or -1
  std::vector<int> turn_unknown_;   // first of three of a bone
  std::vector<Chain> chains_;       // by bone
  TreeEquations equations_;
  std::vector<Pose> locals_;
  std::vector<Pose> world_;
  std::vector<Pose> before_;                   // locals at the start of a solve
  std::vector<Pose> kept_;                     // locals before a step
  std::vector<Eigen::Vector3d> model_places_;  // rest offsets that free lengths are drawn to
  std::vector<double> step_;
  std::vector<Eigen::Vector3d> columns_;  // of one marker's Jacobian
  std::vector<double> row_;               // of the same
  double scale_ = 1.0;
  Eigen::Quaterniond identity_ = Eigen::Quaterniond::Identity();
};

}  // namespace mocap::body
