#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "base/archive.h"
#include "bodyfit/body_offsets.h"
#include "model/skeleton.h"
#include "model/transform.h"

namespace mocap::bodyfit {

/// Consecutive columns [begin, end).
struct ColumnRun {
  int begin = 0;
  int end = 0;
};

/// The columns of a body's unknown offsets in the equations: three for each offset, in depth-first order of the bones,
/// so that the offsets of a limb are consecutive. The last column is the size of the body relative to the file.
struct OffsetColumns {
  explicit OffsetColumns(const MarkerSet& set);

  std::vector<int> bone;    ///< first column of the rest offset, by bone; -1: the root, which has none
  std::vector<int> marker;  ///< first column of the marker offset, by marker
  int size_column = 0;
  int count = 0;  ///< number of columns
};

/// The normal equations of one instant: unknowns of the pose, and their coupling with the offsets of the body.
///
/// The unknowns of the pose are nodes of three (the position of the root, then the rotation of each bone about the
/// world's axes). The nodes form a tree, so that their matrix is factored without fill-in. The pose is then eliminated
/// from the equations of the offsets (Schur complement): the remainder is the information of this instant on the
/// offsets, marginalised over its pose.
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
    double data_m2 = 0.0;            ///< sum of the robust squared distances of the markers
    double weight = 0.0;             ///< sum of the robust weights of the markers: their effective number
    double prior = 0.0;              ///< sum of squared normalised deviations of the pose from its prior
    double observed_unknowns = 0.0;  ///< effective number of pose unknowns that the markers observe; eliminate() only
    double cost(const InstantCost& by) const { return data_m2 / (by.sigma_m * by.sigma_m) + prior; }
    void archive(Archive& members) { members(data_m2, weight, prior, observed_unknowns); }
  };

  /// Improves the pose of the instant by at most `steps` Levenberg-Marquardt steps. Returns the cost of the new pose.
  PoseCost optimise_pose(BodyInstant& instant, const BodyOffsets& offsets, const InstantCost& by, int steps);

  /// Linearises at the pose of the instant and eliminates the pose, for add_to(). Returns the cost of the pose.
  PoseCost eliminate(const BodyInstant& instant, const BodyOffsets& offsets, const InstantCost& by);

  /// Adds one part of the equations H change = -g of the offsets: to H (row by row, `columns().count` wide, lower
  /// triangle only) and to g. The sum over all `parts()` parts is complete; a higher part adds nothing.
  void add_to(std::size_t part, std::span<double> matrix, std::span<double> gradient) const;
  std::size_t parts() const noexcept { return nodes() + 1; }

  /// World pose of a bone, and position of a marker, after the last optimise_pose() or eliminate().
  const Pose& world(std::size_t bone) const { return world_[bone]; }
  const Eigen::Vector3d& place(std::size_t marker) const { return places_[marker]; }

 private:
  // Weighted sums over the markers of a bone and of its descendants, relative to the root.
  struct Moments {
    double weight = 0.0;
    Eigen::Vector3d first = Eigen::Vector3d::Zero();
    Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
    Eigen::Vector3d force = Eigen::Vector3d::Zero();
    Eigen::Vector3d torque = Eigen::Vector3d::Zero();
  };

  // The displacement that the markers of one bone have in common: skin that moves as a whole.
  struct CommonMotion {
    Eigen::Vector3d displacement = Eigen::Vector3d::Zero();  // most probable one
    double weight = 0.0;                                     // sum of the weights of the markers
    Eigen::Vector3d force = Eigen::Vector3d::Zero();         // weighted sum of their residuals
    double share = 0.0;                                      // of the mean marker's information that it takes, 0 to 1
    Eigen::Vector3d at = Eigen::Vector3d::Zero();            // mean marker, relative to the root
  };

  std::size_t nodes() const noexcept { return bones_.size() + 1; }
  void list_runs();
  void pose(const BodyInstant& instant, const BodyOffsets& offsets);
  PoseCost accumulate_markers(const BodyInstant& instant, const BodyOffsets& offsets, const InstantCost& by);
  void place_markers(const BodyInstant& instant, const BodyOffsets& offsets);
  void estimate_common_motion(const BodyInstant& instant, const InstantCost& by);
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
  std::vector<int> bone_of_;        // by marker
  std::vector<int> marker_counts_;  // by bone
  OffsetColumns columns_;
  std::vector<std::vector<std::size_t>> above_;  // by node: its ancestors, nearest first
  std::vector<std::vector<ColumnRun>> runs_;     // by node: columns of the offsets that are coupled with it
  std::vector<Pose> world_;
  std::vector<Eigen::Vector3d> places_;
  std::vector<double> weights_;                   // by marker
  std::vector<Eigen::Vector3d> off_;              // by marker: modelled minus measured position
  std::vector<Moments> moments_;                  // by bone
  std::vector<CommonMotion> common_;              // by bone
  double marker_scale_ = 1.0;                     // 1 / (variance of a marker), 1/m^2
  std::vector<Eigen::Matrix3d> matrix_, factor_;  // by node and ancestor
  std::vector<Eigen::Vector3d> gradient_;         // by node
  std::vector<Eigen::Vector3d> step_;             // by node; after whiten(): the whitened gradient
  std::vector<double> rows_;                      // three for each node: coupling with the offsets, whitened
  std::vector<Pose> previous_locals_;             // the pose before a step that may be rejected
};

}  // namespace mocap::bodyfit
