#include <Eigen/Cholesky>
#include <algorithm>

#include "base/expects.h"
#include "bodyfit/instant_equations.h"
#include "kinematics/algebra.h"

// The part of InstantEquations that eliminates the pose.

namespace mocap::bodyfit {
namespace {

using kinematics::cross_matrix;
using kinematics::squared;

}  // namespace

// Writes the coupling blocks of H between the nodes of the pose and the offsets.
void InstantEquations::couple() {
  const auto width = static_cast<std::size_t>(columns_.count);
  for (std::size_t n = 0; n < nodes(); ++n) {
    for (const ColumnRun run : runs_[n]) {
      for (std::size_t row = 0; row < 3; ++row)
        std::fill(rows_of(n) + row * width + run.begin, rows_of(n) + row * width + run.end, 0.0);
    }
  }
  const auto put = [&](std::size_t node, int column, const Eigen::Matrix3d& value) {
    for (int row = 0; row < 3; ++row) {
      for (int i = 0; i < 3; ++i)
        rows_of(node)[static_cast<std::size_t>(row) * width + static_cast<std::size_t>(column + i)] = value(row, i);
    }
  };
  const auto joint = [&](std::size_t b) -> Eigen::Vector3d { return world_[b].position - world_[0].position; };
  for (std::size_t c = 1; c < bones_.size(); ++c) {
    const Eigen::Matrix3d rotation = world_[static_cast<std::size_t>(bones_[c].parent)].rotation.toRotationMatrix();
    put(0, columns_.bone[c], moments_[c].weight * rotation);
    for (std::size_t d = 0; d < bones_.size(); ++d) {
      const bool c_below =
          d == c || std::find(above_[c + 1].begin(), above_[c + 1].end(), d + 1) != above_[c + 1].end();
      const bool d_below = std::find(above_[d + 1].begin(), above_[d + 1].end(), c + 1) != above_[d + 1].end();
      if (!c_below && !d_below) continue;
      const Moments& shared = moments_[c_below ? c : d];
      put(d + 1, columns_.bone[c], cross_matrix(shared.first - shared.weight * joint(d)) * rotation);
    }
  }
  for (std::size_t m = 0; m < places_.size(); ++m) {
    const auto own = static_cast<std::size_t>(bone_of_[m]);
    const CommonMotion& common = common_[own];
    const Eigen::Matrix3d rotation = weights_[m] * world_[own].rotation.toRotationMatrix();
    put(0, columns_.marker[m], (1.0 - common.share) * rotation);
    for (int d = bone_of_[m]; d >= 0; d = bones_[static_cast<std::size_t>(d)].parent) {
      const Eigen::Vector3d joint_m = joint(static_cast<std::size_t>(d));
      const Eigen::Vector3d lever = places_[m] - world_[0].position - joint_m - common.share * (common.at - joint_m);
      put(static_cast<std::size_t>(d) + 1, columns_.marker[m], cross_matrix(lever) * rotation);
    }
  }
}

// Sums, over the unknowns, the fraction of the information that does not come from the prior, given the ancestors. The
// position of the root has no prior.
double InstantEquations::observed_unknowns(const BodyInstant& instant, const InstantCost& by) const {
  double observed_unknowns = 3.0;
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    const bool held = instant.at_rest[b] != 0;
    const double sigma = b == 0 ? by.upright_sigma_rad : held ? by.at_rest_sigma_rad : by.rest_sigma_rad;
    const double prior = b == 0 && !held ? 0.0 : 1.0 / squared(sigma);
    const Eigen::Matrix3d& own = factored(b + 1, b + 1);
    const Eigen::Matrix3d spread =
        own.triangularView<Eigen::Lower>().solve(Eigen::Matrix3d(Eigen::Matrix3d::Identity()));
    observed_unknowns += std::max(0.0, 3.0 - prior * spread.squaredNorm());
  }
  return observed_unknowns;
}

// Multiplies the coupling blocks by L^-T, and the gradient, into `step_`.
void InstantEquations::whiten() {
  const auto width = static_cast<std::size_t>(columns_.count);
  std::copy(gradient_.begin(), gradient_.end(), step_.begin());
  for (std::size_t n = nodes(); n-- > 0;) {
    const Eigen::Matrix3d upper = factored(n, n).transpose();
    const double i0 = 1.0 / upper(0, 0), i1 = 1.0 / upper(1, 1), i2 = 1.0 / upper(2, 2);
    double *r0 = rows_of(n), *r1 = r0 + width, *r2 = r1 + width;
    for (const ColumnRun run : runs_[n]) {
      for (int i = run.begin; i < run.end; ++i) {
        r2[i] *= i2;
        r1[i] = (r1[i] - upper(1, 2) * r2[i]) * i1;
        r0[i] = (r0[i] - upper(0, 1) * r1[i] - upper(0, 2) * r2[i]) * i0;
      }
    }
    step_[n] = upper.triangularView<Eigen::Upper>().solve(step_[n]);
    for (const std::size_t a : above_[n]) {
      const Eigen::Matrix3d& by = factored(n, a);
      step_[a] -= by.transpose() * step_[n];
      for (int row = 0; row < 3; ++row) {
        double* to = rows_of(a) + static_cast<std::size_t>(row) * width;
        const double b0 = by(0, row), b1 = by(1, row), b2 = by(2, row);
        for (const ColumnRun run : runs_[n]) {
          for (int i = run.begin; i < run.end; ++i) to[i] -= b0 * r0[i] + b1 * r1[i] + b2 * r2[i];
        }
      }
    }
  }
}

InstantEquations::PoseCost InstantEquations::eliminate(const BodyInstant& instant, const BodyOffsets& offsets,
                                                       const InstantCost& by) {
  PoseCost pose_cost = linearise(instant, offsets, by);
  couple();
  // The priors make the matrix positive definite. If rounding prevents the factorisation, damping reduces the
  // information of this instant.
  for (double damping = 0.0; !factor(damping); damping = damping == 0.0 ? 1e-6 : 10.0 * damping) {
    if (damping > 1e6) {
      std::fill(rows_.begin(), rows_.end(), 0.0);
      break;
    }
  }
  pose_cost.observed_unknowns = observed_unknowns(instant, by);
  whiten();
  return pose_cost;
}

// Adds the equations of the offsets for a fixed pose.
void InstantEquations::add_direct_terms(std::span<double> matrix, std::span<double> gradient) const {
  const auto width = static_cast<std::size_t>(columns_.count);
  const auto add = [&](int row, int column, const Eigen::Matrix3d& value) {
    const bool swapped = column > row;
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < (row == column ? i + 1 : 3); ++j) {
        const auto r = static_cast<std::size_t>(swapped ? column + j : row + i);
        const auto c = static_cast<std::size_t>(swapped ? row + i : column + j);
        matrix[r * width + c] += value(i, j);
      }
    }
  };
  const auto add_gradient = [&](int column, const Eigen::Vector3d& value) {
    for (int i = 0; i < 3; ++i) gradient[static_cast<std::size_t>(column + i)] += value[i];
  };
  const auto parent_rotation = [&](std::size_t b) {
    return world_[static_cast<std::size_t>(bones_[b].parent)].rotation.toRotationMatrix();
  };
  for (std::size_t c = 1; c < bones_.size(); ++c) {
    const Eigen::Matrix3d rotation = parent_rotation(c);
    add_gradient(columns_.bone[c], rotation.transpose() * moments_[c].force);
    for (std::size_t e = c; bones_[e].parent >= 0; e = static_cast<std::size_t>(bones_[e].parent)) {
      add(columns_.bone[c], columns_.bone[e], moments_[c].weight * rotation.transpose() * parent_rotation(e));
    }
  }
  for (std::size_t m = 0; m < places_.size(); ++m) {
    if (weights_[m] == 0.0) continue;
    const auto own = static_cast<std::size_t>(bone_of_[m]);
    const Eigen::Matrix3d rotation = world_[own].rotation.toRotationMatrix();
    const CommonMotion& common = common_[own];
    add_gradient(columns_.marker[m], weights_[m] * (rotation.transpose() * (off_[m] - common.displacement)));
    add(columns_.marker[m], columns_.marker[m], weights_[m] * Eigen::Matrix3d::Identity());
    for (std::size_t n = 0; n <= m; ++n) {
      if (bone_of_[n] != bone_of_[m] || weights_[n] == 0.0) continue;
      const double shared = weights_[m] * weights_[n] / common.weight * common.share;
      add(columns_.marker[m], columns_.marker[n], -shared * Eigen::Matrix3d::Identity());
    }
    for (std::size_t e = own; bones_[e].parent >= 0; e = static_cast<std::size_t>(bones_[e].parent)) {
      add(columns_.marker[m], columns_.bone[e],
          (1.0 - common.share) * weights_[m] * rotation.transpose() * parent_rotation(e));
    }
  }
}

void InstantEquations::add_to(std::size_t part, std::span<double> matrix, std::span<double> gradient) const {
  const auto width = static_cast<std::size_t>(columns_.count);
  MOCAP_EXPECTS(matrix.size() == width * width && gradient.size() == width);
  if (part >= nodes()) {
    if (part == nodes()) add_direct_terms(matrix, gradient);
    return;
  }
  const double* r0 = rows_.data() + part * 3 * width;
  const double *r1 = r0 + width, *r2 = r1 + width;
  const Eigen::Vector3d& force = step_[part];
  for (const ColumnRun run : runs_[part]) {
    for (int i = run.begin; i < run.end; ++i) {
      gradient[static_cast<std::size_t>(i)] -= r0[i] * force[0] + r1[i] * force[1] + r2[i] * force[2];
      double* to = matrix.data() + static_cast<std::size_t>(i) * width;
      const double b0 = r0[i], b1 = r1[i], b2 = r2[i];
      for (const ColumnRun left : runs_[part]) {
        if (left.begin > i) break;
        const int end = std::min(left.end, i + 1);
        for (int j = left.begin; j < end; ++j) to[j] -= b0 * r0[j] + b1 * r1[j] + b2 * r2[j];
      }
    }
  }
}

}  // namespace mocap::bodyfit
