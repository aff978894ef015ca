#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "base/archive.h"
#include "bodyfit/body_offsets.h"
#include "bodyfit/instant_equations.h"
#include "model/skeleton.h"

namespace mocap::bodyfit {

/// Standard deviations of a body from the marker set of the file.
struct OffsetPriors {
  double size_sigma = 0.15;         ///< of the size, as a fraction of it
  double stretch_sigma = 0.08;      ///< of a bone's length at that size, as a fraction of it
  double bend_sigma_m = 0.015;      ///< of a rest offset across its length
  double marker_sigma_m = 0.015;    ///< of a marker on its bone: markers are placed by hand
  double in_joint_sigma_m = 0.002;  ///< of a marker that sits in the joint
  double symmetry_sigma = 0.04;     ///< of the difference of a left and a right bone, as a fraction of the length
};

/// Priors for a fitted body in a new session: the bones do not change, markers are placed again.
OffsetPriors priors_of_fitted();

/// The normal equations of a body's offsets, summed over all instants and the priors, and their solution in steps of
/// bounded work.
///
/// Allocates in the constructor only.
class OffsetEquations {
 public:
  OffsetEquations(const MarkerSet& file, const OffsetColumns& columns, const OffsetPriors& priors);

  /// Replaces the priors, and sets the equations to zero.
  void set_priors(const OffsetPriors& priors);

  /// The cost of the priors at these offsets: a sum of squared normalised deviations, robust for the markers.
  double prior_cost(const BodyOffsets& offsets, double size) const;

  /// Sets the equations to zero, and forgets their solution.
  void clear();
  /// The matrix H, row by row (lower triangle only), and the gradient g, to which instants add their information.
  std::span<double> matrix() noexcept { return matrix_; }
  std::span<double> gradient() noexcept { return gradient_; }
  /// Adds the information of the priors at these offsets.
  void add_priors(const BodyOffsets& offsets, double size);

  /// Begins to solve (H + damping diag H) change = -g. The equations do not change.
  void begin_solve(double damping);
  /// Continues by about this number of multiplications. Returns true when the solution is complete or impossible.
  [[nodiscard]] bool work(std::size_t multiplications);
  /// Whether the equations had a finite solution.
  bool solved() const noexcept { return solved_; }
  /// Effective number of unknowns that the instants determine, not the priors, according to the last solution.
  double observed_unknowns() const;
  /// Adds the solution to the arguments. Returns the largest change of an offset, m.
  double apply(BodyOffsets& offsets, double& size) const;

  /// Writes the equations and the solution in progress, or takes them over from equations of the same marker set and
  /// priors (see Archive).
  void archive(Archive& members);

 private:
  struct Pair {
    std::size_t left, right;  // bones
    double weight = 0.0;      // 1/m^2
  };

  Eigen::Vector3d symmetry_error(const Pair& pair, const BodyOffsets& offsets, double size) const;
  void add_block(int row, int column, const Eigen::Matrix3d& value);
  std::size_t factor_row(std::size_t row);

  OffsetColumns columns_;
  BodyOffsets file_;
  double size_weight_ = 0.0;
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
