#include "body/tree_equations.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/expects.h"

namespace mocap::body {

TreeEquations::TreeEquations(std::vector<int> parents)
    : parents_(std::move(parents)),
      matrix_(parents_.size() * parents_.size()),
      right_(parents_.size()),
      factor_(matrix_.size()) {
  for (std::size_t i = 0; i < parents_.size(); ++i) MOCAP_EXPECTS(parents_[i] < static_cast<int>(i));
}

void TreeEquations::clear() {
  std::fill(matrix_.begin(), matrix_.end(), 0.0);
  std::fill(right_.begin(), right_.end(), 0.0);
}

bool TreeEquations::factor() { return factor_damped(0.0, 1e-9); }

bool TreeEquations::factor_damped(double damping, double least) {
  const std::size_t n = size();
  const auto row = [&](int i) { return factor_.data() + static_cast<std::size_t>(i) * n; };
  factor_ = matrix_;
  for (std::size_t i = 0; i < n; ++i) factor_[i * n + i] += damping * matrix_[i * n + i] + least;

  for (int k = static_cast<int>(n) - 1; k >= 0; --k) {
    double* const rk = row(k);
    if (!(rk[k] > 0.0) || !std::isfinite(rk[k])) return false;
    rk[k] = std::sqrt(rk[k]);
    const double inverse = 1.0 / rk[k];
    for (int i = parents_[static_cast<std::size_t>(k)]; i >= 0; i = parents_[static_cast<std::size_t>(i)])
      rk[i] *= inverse;
    for (int i = parents_[static_cast<std::size_t>(k)]; i >= 0; i = parents_[static_cast<std::size_t>(i)]) {
      double* const ri = row(i);
      for (int j = i; j >= 0; j = parents_[static_cast<std::size_t>(j)]) ri[j] -= rk[i] * rk[j];
    }
  }
  return true;
}

void TreeEquations::whiten(std::span<const int> chain, std::span<double> v) const {
  for (std::size_t i = chain.size(); i-- > 0;) {
    const double* const ri = factor_.data() + static_cast<std::size_t>(chain[i]) * size();
    v[i] /= ri[chain[i]];
    for (std::size_t j = 0; j < i; ++j) v[j] -= ri[chain[j]] * v[i];
  }
}

bool TreeEquations::solve(double damping, std::span<double> x) {
  MOCAP_EXPECTS(x.size() == size());
  const std::size_t n = size();
  const auto row = [&](int i) { return factor_.data() + static_cast<std::size_t>(i) * n; };
  if (!factor_damped(damping, damping)) return false;

  // H = L^T L: first L^T y = b from the leaves up, then L x = y from the root down.
  std::copy(right_.begin(), right_.end(), x.begin());
  for (int i = static_cast<int>(n) - 1; i >= 0; --i) {
    const double* const ri = row(i);
    double& xi = x[static_cast<std::size_t>(i)];
    xi /= ri[i];
    for (int j = parents_[static_cast<std::size_t>(i)]; j >= 0; j = parents_[static_cast<std::size_t>(j)]) {
      x[static_cast<std::size_t>(j)] -= ri[j] * xi;
    }
  }
  for (int i = 0; i < static_cast<int>(n); ++i) {
    const double* const ri = row(i);
    double& xi = x[static_cast<std::size_t>(i)];
    for (int j = parents_[static_cast<std::size_t>(i)]; j >= 0; j = parents_[static_cast<std::size_t>(j)]) {
      xi -= ri[j] * x[static_cast<std::size_t>(j)];
    }
    xi /= ri[i];
  }
  return std::all_of(x.begin(), x.end(), [](double value) { return std::isfinite(value); });
}

}  // namespace mocap::body
