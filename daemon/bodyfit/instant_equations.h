#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "bodyfit/body_offsets.h"
#include "model/skeleton.h"
#include "model/transform.h"

namespace mocap::bodyfit {

/// Columns that stand side by side: [begin, end).
struct ColumnRun {
  int begin = 0;
  int end = 0;
};

/// Where the unknown offsets of a body stand: three columns each, those of a limb side by side; the last column is the
/// body's size against the file's.
struct OffsetColumns {
  explicit OffsetColumns(const MarkerSet& set);

  std::vector<int> bone;    ///< first column of a bone's rest offset, by bone; -1: the root, which has none
  std::vector<int> marker;  ///< of a marker's offset, by marker
  int size_column = 0;
  int count = 0;  ///< of all columns
};

/// The normal equations of one instant of a body: its pose, and how the body's offsets move with it.
///
/// The pose's unknowns are nodes of three (the root's place, then each bone's turn) that hang in a tree, so that their
/// matrix is factored without fill-in. What the pose takes up is then subtracted from the equations of the offsets
/// (Schur complement): what is left says what this instant tells of the offsets whatever its pose.
///
/// Allocates in the constructor only.
///
/// Source: Featherstone, "Efficient factorization of the joint-space inertia matrix for branched kinematic trees"
/// (2005), the L^T L method, here by blocks of 3x3; Triggs et al., "Bundle adjustment - a modern synthesis" (2000),
/// section 6.1, for the elimination.
class InstantEquations {
 public:
  explicit InstantEquations(const MarkerSet& set);

  const OffsetColumns& columns() const noexcept { return columns_; }

  struct PoseCost {
    double data_m2 = 0.0;            ///< sum of the markers' squared distances, robust
    double weight = 0.0;             ///< sum of the markers' weights: how many count
    double prior = 0.0;              ///< sum of the pose's squared deviations, each over its sigma
    double observed_unknowns = 0.0;  ///< how many of the pose's unknowns the markers tell; of `eliminate` only
    double cost(const InstantCost& by) const { return data_m2 / (by.sigma_m * by.sigma_m) + prior; }
  };

  /// Moves the instant's pose towards what explains its markers, `steps` times at most; what it then costs.
  PoseCost optimise_pose(BodyInstant& instant, const BodyOffsets& offsets, const InstantCost& by, int steps);

  /// Prepares `add_to` for the pose that the instant has.
  PoseCost eliminate(const BodyInstant& instant, const BodyOffsets& offsets, const InstantCost& by);

  /// Adds to H (row by row, `columns().count` wide, only at and left of the diagonal) and g: the equations are
  /// H change = -g. In `parts()` parts, each about as much work; 0 <= part.
  void add_to(std::size_t part, std::span<double> matrix, std::span<double> gradient) const;
  std::size_t parts() const noexcept { return nodes() + 1; }

  /// World pose of a bone, and place of a marker, of the last `optimise_pose` or `eliminate`.
  const Pose& world(std::size_t bone) const { return world_[bone]; }
  const Eigen::Vector3d& place(std::size_t marker) const { return places_[marker]; }

 private:
  struct Moments {  // of the markers on a bone and all below it
    double weight = 0.0;
    Eigen::Vector3d first = Eigen::Vector3d::Zero();
    Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    Eigen::Vector3d torque = Eigen::Vector3d::Zero();
  };

  std::size_t nodes() const noexcept { return bones_.size() + 1; }
  void list_runs();
  void pose(const BodyInstant& instant, const BodyOffsets& offsets);
  PoseCost accumulate_markers(const BodyInstant& instant, const BodyOffsets& offsets, const InstantCost& by);
  double accumulate_joint_priors(const BodyInstant& instant, const InstantCost& by);
  double accumulate_tilt_prior(const BodyInstant& instant, const InstantCost& by);
  PoseCost linearise(const BodyInstant& instant, const BodyOffsets& offsets, const InstantCost& by);
  bool factor(double damping);
  double observed_unknowns(const BodyInstant& instant, const InstantCost& by) const;
  void solve_step();
  void apply_step(BodyInstant& instant) const;
  void couple();
  void whiten();
  void add_direct_terms(std::span<double> matrix, std::span<double> gradient) const;
  Eigen::Matrix3d& block(std::size_t lower, std::size_t upper) { return matrix_[lower * nodes() + upper]; }
  const Eigen::Matrix3d& factored(std::size_t lower, std::size_t upper) const {
    return factor_[lower * nodes() + upper];
  }
  double* rows_of(std::size_t node) { return rows_.data() + node * 3 * static_cast<std::size_t>(columns_.count); }

  std::vector<Bone> bones_;
  std::vector<int> bone_of_;  // by marker
  OffsetColumns columns_;
  std::vector<std::vector<std::size_t>> above_;  // by node: its ancestors, nearest first
  std::vector<std::vector<ColumnRun>> runs_;     // by node: the offsets that it meets
  std::vector<Pose> world_;
  std::vector<Eigen::Vector3d> places_;
  std::vector<double> weights_;                   // by marker
  std::vector<Eigen::Vector3d> off_;              // by marker
  std::vector<Moments> moments_;                  // by bone
  double marker_scale_ = 1.0;                     // one over the variance of a marker
  std::vector<Eigen::Matrix3d> matrix_, factor_;  // by node and ancestor
  std::vector<Eigen::Vector3d> gradient_;         // by node
  std::vector<Eigen::Vector3d> step_;             // by node; after `whiten`: the gradient, whitened
  std::vector<double> rows_;                      // three a node: how the offsets meet it, whitened
  std::vector<Pose> kept_;
};

}  // namespace mocap::bodyfit
