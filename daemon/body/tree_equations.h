#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace mocap::body {

/// Normal equations H x = b of unknowns that hang in a tree: two unknowns meet only if one is an ancestor of the
/// other. They are factored without fill-in, in time that grows with the sum of the squared depths.
///
/// Allocates in the constructor only.
///
/// Source: Featherstone, "Efficient factorization of the joint-space inertia matrix for branched kinematic trees"
/// (2005), the L^T L method.
class TreeEquations {
 public:
  /// `parents[i]` is the unknown above unknown i, less than i, or -1.
  explicit TreeEquations(std::vector<int> parents);

  std::size_t size() const noexcept { return parents_.size(); }
  void clear();

  /// Adds to H at (lower, upper), where `upper` is `lower` itself or an ancestor of it, and to b.
  void add(std::size_t lower, std::size_t upper, double value) { matrix_[lower * size() + upper] += value; }
  void add_right(std::size_t i, double value) { right_[i] += value; }

  /// Solves (H + damping * (diag(H) + 1)) x = b; the equations stay as they were. False, and `x` undefined, when H is
  /// not positive definite.
  [[nodiscard]] bool solve(double damping, std::span<double> x);

  /// Factors H + 1e-9 for `whiten`. False when H is not positive definite.
  [[nodiscard]] bool factor();

  /// Replaces v, which is nought but at `chain` (an unknown's ancestors and itself, from the root down), by L^-T v of
  /// the last `factor`, H = L^T L: its squared length is v^T H^-1 v. `v` is by the place in the chain.
  void whiten(std::span<const int> chain, std::span<double> v) const;

 private:
  [[nodiscard]] bool factor_damped(double damping, double least);

  std::vector<int> parents_;
  std::vector<double> matrix_;  // row by row, ancestors only
  std::vector<double> right_;
  std::vector<double> factor_;
};

}  // namespace mocap::body
