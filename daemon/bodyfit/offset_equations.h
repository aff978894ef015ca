#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "bodyfit/body_offsets.h"
#include "bodyfit/instant_equations.h"
#include "model/skeleton.h"

namespace mocap::bodyfit {

/// What is known of a body before it is looked at: how far it may be from the file's.
struct OffsetPriors {
  double size_sigma = 0.15;         ///< of the whole body against the file's, share of it
  double stretch_sigma = 0.08;      ///< of a bone's length beside that, share of it
  double bend_sigma_m = 0.015;      ///< of a rest offset across its length
  double marker_sigma_m = 0.015;    ///< of a marker on its bone: where people stick it
  double in_joint_sigma_m = 0.002;  ///< of a marker that the file puts into the joint itself
  double symmetry_sigma = 0.04;     ///< of a left bone's length against the right one's, share of it
};

/// For a body that was fitted before: bones do not change; markers are stuck on anew.
OffsetPriors priors_of_fitted();

/// The normal equations of a body's offsets: what all its instants and the priors say, and their solution in pieces.
///
/// Allocates in the constructor only.
class OffsetEquations {
 public:
  OffsetEquations(const MarkerSet& file, const OffsetColumns& columns, const OffsetPriors& priors);

  /// What the priors say of offsets: the sum of squares, each over its sigma.
  double prior_cost(const BodyOffsets& offsets, double size) const;

  void clear();
  std::span<double> matrix() noexcept { return matrix_; }
  std::span<double> gradient() noexcept { return gradient_; }
  void add_priors(const BodyOffsets& offsets, double size);

  /// Begins to solve (H + damping diag H) change = -g; `work` goes on, so many multiplications at most, until it says
  /// that it is done. The equations stay as they were.
  void begin_solve(double damping);
  [[nodiscard]] bool work(std::size_t multiplications);
  /// Whether the equations had a solution.
  bool solved() const noexcept { return solved_; }
  /// How many of the offsets' unknowns are told by more than the priors, by the last solution.
  double observed_unknowns() const;
  /// Adds the solution; gives the largest change, m.
  double apply(BodyOffsets& offsets, double& size) const;

 private:
  struct Pair {
    std::size_t left, right;  // bones
    double weight;
  };

  Eigen::Vector3d mirrored_off(const Pair& pair, const BodyOffsets& offsets, double size) const;
  void add_block(int row, int column, const Eigen::Matrix3d& value);
  std::size_t factor_row(std::size_t row);

  OffsetColumns columns_;
  BodyOffsets file_;
  double size_weight_;
  std::vector<Eigen::Matrix3d> bone_weights_;
  std::vector<double> marker_weights_;
  std::vector<Pair> pairs_;
  std::vector<double> matrix_, factor_;
  std::vector<double> gradient_, change_;
  std::vector<double> prior_diagonal_;
  double damping_ = 0.0;
  std::size_t row_ = 0;
  bool solved_ = false;
};

}  // namespace mocap::bodyfit
