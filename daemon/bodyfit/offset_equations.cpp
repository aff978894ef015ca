#include "bodyfit/offset_equations.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include "base/expects.h"
#include "kinematics/algebra.h"
#include "kinematics/kinematic_tree.h"

namespace mocap::bodyfit {
namespace {

using kinematics::squared;

// Scale of the Cauchy prior on marker offsets. A marker farther than this from its offset in the file was placed
// elsewhere (higher or lower on a thigh); the prior then hardly restrains it.
constexpr double kCauchyScale_sigmas = 2.0;
// Left and right differ by this much on any body: by the placement of markers and the assumed joint centres.
constexpr double kSymmetrySigmaFloor_m = 0.003;

// Information matrix, 1/m^2, of a bone's rest offset.
Eigen::Matrix3d bone_weight(const Eigen::Vector3d& rest_m, const OffsetPriors& priors) {
  const double across = 1.0 / squared(priors.bend_sigma_m);
  const double length = rest_m.norm();
  if (length < kinematics::kInJoint_m) return across * Eigen::Matrix3d::Identity();
  const Eigen::Vector3d u = rest_m / length;
  // At least 0.3 times the deviation across: the length of a short bone depends on the assumed centres of its joints.
  const double along = 1.0 / squared(std::max(priors.stretch_sigma * length, 0.3 * priors.bend_sigma_m));
  return across * Eigen::Matrix3d::Identity() + (along - across) * u * u.transpose();
}

double cauchy_cost(double squared_sigmas) {
  return squared(kCauchyScale_sigmas) * std::log1p(squared_sigmas / squared(kCauchyScale_sigmas));
}
double cauchy_weight(double squared_sigmas) { return 1.0 / (1.0 + squared_sigmas / squared(kCauchyScale_sigmas)); }

Eigen::Vector3d mirrored(const Eigen::Vector3d& v) { return {v.x(), -v.y(), v.z()}; }

}  // namespace

OffsetPriors priors_of_fitted() {
  return {.size_sigma = 0.002,
          .stretch_sigma = 0.01,
          .bend_sigma_m = 0.003,
          .marker_sigma_m = 0.006,
          .in_joint_sigma_m = 0.002,
          .symmetry_sigma = 1.0};
}

OffsetEquations::OffsetEquations(const MarkerSet& file, const OffsetColumns& columns, const OffsetPriors& priors)
    : columns_(columns), file_(offsets_of(file)) {
  const auto& bones = file.skeleton.bones;
  bone_weights_.resize(bones.size());
  marker_weights_.resize(file.markers.size());
  constexpr std::string_view kLeft = "Left";
  for (std::size_t b = 1; b < bones.size(); ++b) {
    if (!bones[b].name.starts_with(kLeft)) continue;
    const std::string other = "Right" + bones[b].name.substr(kLeft.size());
    for (std::size_t r = 1; r < bones.size(); ++r) {
      if (bones[r].name == other) pairs_.push_back({b, r});
    }
  }
  const auto count = static_cast<std::size_t>(columns_.count);
  matrix_.resize(count * count);
  factor_.resize(matrix_.size());
  gradient_.resize(count);
  change_.resize(count);
  prior_diagonal_.resize(count);
  set_priors(priors);
}

void OffsetEquations::set_priors(const OffsetPriors& priors) {
  size_weight_ = 1.0 / squared(priors.size_sigma);
  for (std::size_t b = 0; b < file_.bones_m.size(); ++b) bone_weights_[b] = bone_weight(file_.bones_m[b], priors);
  for (std::size_t m = 0; m < file_.markers_m.size(); ++m) {
    const bool in_joint = file_.markers_m[m].norm() < kinematics::kInJoint_m;
    marker_weights_[m] = 1.0 / squared(in_joint ? priors.in_joint_sigma_m : priors.marker_sigma_m);
  }
  for (Pair& pair : pairs_) {
    const double sigma_m = kSymmetrySigmaFloor_m + priors.symmetry_sigma * file_.bones_m[pair.left].norm();
    pair.weight = 1.0 / squared(sigma_m);
  }
  // The diagonal of the priors at the file's offsets. At other offsets, only the Cauchy weights of the markers differ.
  clear();
  add_priors(file_, 1.0);
  const std::size_t count = prior_diagonal_.size();
  for (std::size_t i = 0; i < count; ++i) prior_diagonal_[i] = matrix_[i * count + i];
  clear();
}

// Difference of a left bone from the mirror image of the right bone, minus the same difference in the file.
Eigen::Vector3d OffsetEquations::symmetry_error(const Pair& pair, const BodyOffsets& offsets, double size) const {
  return offsets.bones_m[pair.left] - mirrored(offsets.bones_m[pair.right]) -
         size * (file_.bones_m[pair.left] - mirrored(file_.bones_m[pair.right]));
}

double OffsetEquations::prior_cost(const BodyOffsets& offsets, double size) const {
  double sum = size_weight_ * squared(size - 1.0);
  for (std::size_t b = 0; b < file_.bones_m.size(); ++b) {
    if (columns_.bone[b] < 0) continue;
    const Eigen::Vector3d off = offsets.bones_m[b] - size * file_.bones_m[b];
    sum += off.dot(bone_weights_[b] * off);
  }
  for (std::size_t m = 0; m < file_.markers_m.size(); ++m) {
    sum += cauchy_cost(marker_weights_[m] * (offsets.markers_m[m] - size * file_.markers_m[m]).squaredNorm());
  }
  for (const Pair& pair : pairs_) sum += pair.weight * symmetry_error(pair, offsets, size).squaredNorm();
  return sum;
}

void OffsetEquations::clear() {
  std::fill(matrix_.begin(), matrix_.end(), 0.0);
  std::fill(gradient_.begin(), gradient_.end(), 0.0);
  damping_ = 0.0;
  row_ = 0;
  solved_ = false;
}

void OffsetEquations::add_block(int row, int column, const Eigen::Matrix3d& value) {
  const auto width = static_cast<std::size_t>(columns_.count);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      const auto r = static_cast<std::size_t>(row + i), c = static_cast<std::size_t>(column + j);
      if (c <= r) matrix_[r * width + c] += value(i, j);
    }
  }
}

void OffsetEquations::add_priors(const BodyOffsets& offsets, double size) {
  const auto width = static_cast<std::size_t>(columns_.count);
  double* const size_row = matrix_.data() + static_cast<std::size_t>(columns_.size_column) * width;
  double& size_gradient = gradient_[static_cast<std::size_t>(columns_.size_column)];
  size_row[columns_.size_column] += size_weight_;
  size_gradient += size_weight_ * (size - 1.0);
  const auto add_off = [&](int column, const Eigen::Matrix3d& weight, const Eigen::Vector3d& file,
                           const Eigen::Vector3d& off) {
    const Eigen::Vector3d force = weight * off, by_size = weight * file;
    add_block(column, column, weight);
    for (int i = 0; i < 3; ++i) {
      gradient_[static_cast<std::size_t>(column + i)] += force[i];
      size_row[column + i] -= by_size[i];
    }
    size_row[columns_.size_column] += file.dot(by_size);
    size_gradient -= file.dot(force);
  };
  for (std::size_t b = 0; b < file_.bones_m.size(); ++b) {
    if (columns_.bone[b] < 0) continue;
    add_off(columns_.bone[b], bone_weights_[b], file_.bones_m[b], offsets.bones_m[b] - size * file_.bones_m[b]);
  }
  for (std::size_t m = 0; m < file_.markers_m.size(); ++m) {
    const Eigen::Vector3d off = offsets.markers_m[m] - size * file_.markers_m[m];
    const double weight = marker_weights_[m] * cauchy_weight(marker_weights_[m] * off.squaredNorm());
    add_off(columns_.marker[m], weight * Eigen::Matrix3d::Identity(), file_.markers_m[m], off);
  }
  const Eigen::Matrix3d mirror = Eigen::Vector3d(1.0, -1.0, 1.0).asDiagonal();
  for (const Pair& pair : pairs_) {
    const int left = columns_.bone[pair.left], right = columns_.bone[pair.right];
    const Eigen::Vector3d off = symmetry_error(pair, offsets, size);
    const Eigen::Vector3d file = file_.bones_m[pair.left] - mirror * file_.bones_m[pair.right];
    add_off(left, pair.weight * Eigen::Matrix3d::Identity(), file, off);
    add_block(right, right, pair.weight * Eigen::Matrix3d::Identity());
    add_block(std::max(left, right), std::min(left, right), -pair.weight * mirror);
    const Eigen::Vector3d force = -pair.weight * (mirror * off), by_size = -pair.weight * (mirror * file);
    for (int i = 0; i < 3; ++i) {
      gradient_[static_cast<std::size_t>(right + i)] += force[i];
      size_row[right + i] -= by_size[i];
    }
  }
}

void OffsetEquations::begin_solve(double damping) {
  damping_ = damping;
  row_ = 0;
  solved_ = true;
}

// Computes one row of the Cholesky factor and of the forward substitution. Returns the number of multiplications.
std::size_t OffsetEquations::factor_row(std::size_t row) {
  const auto width = static_cast<std::size_t>(columns_.count);
  const double* const from = matrix_.data() + row * width;
  double* const to = factor_.data() + row * width;
  double right = -gradient_[row];
  for (std::size_t j = 0; j < row; ++j) {
    const double* const other = factor_.data() + j * width;
    double sum = from[j];
    for (std::size_t k = 0; k < j; ++k) sum -= to[k] * other[k];
    to[j] = sum / other[j];
    right -= to[j] * change_[j];
  }
  double own = from[row] * (1.0 + damping_);
  for (std::size_t k = 0; k < row; ++k) own -= to[k] * to[k];
  solved_ = own > 0.0 && std::isfinite(own);
  to[row] = solved_ ? std::sqrt(own) : 1.0;
  change_[row] = right / to[row];
  return row * row / 2 + 2 * row + 20;
}

bool OffsetEquations::work(std::size_t multiplications) {
  const auto width = static_cast<std::size_t>(columns_.count);
  std::size_t spent = 0;
  while (solved_ && row_ < width && spent < multiplications) spent += factor_row(row_++);
  if (!solved_) return true;
  if (row_ < width || spent + width * width / 2 > std::max(multiplications, width * width)) return false;
  for (std::size_t i = width; i-- > 0;) {
    const double* const row = factor_.data() + i * width;
    change_[i] /= row[i];
    for (std::size_t j = 0; j < i; ++j) change_[j] -= row[j] * change_[i];
  }
  solved_ = std::all_of(change_.begin(), change_.end(), [](double value) { return std::isfinite(value); });
  return true;
}

double OffsetEquations::observed_unknowns() const {
  const auto width = static_cast<std::size_t>(columns_.count);
  double observed_unknowns = 0.0;
  for (std::size_t i = 0; i < width; ++i) {
    observed_unknowns += std::max(0.0, 1.0 - prior_diagonal_[i] / std::pow(factor_[i * width + i], 2));
  }
  return observed_unknowns;
}

// Only the lower triangle of matrix and factor is used, and only the computed rows of factor and solution.
void OffsetEquations::archive(Archive& members) {
  const auto width = static_cast<std::size_t>(columns_.count);
  members(gradient_, damping_, solved_);
  row_ = members.count(row_, width);
  for (std::size_t row = 0; row < width; ++row) {
    for (std::size_t column = 0; column <= row; ++column) members(matrix_[row * width + column]);
  }
  for (std::size_t row = 0; row < row_; ++row) {
    for (std::size_t column = 0; column <= row; ++column) members(factor_[row * width + column]);
    members(change_[row]);
  }
}

double OffsetEquations::apply(BodyOffsets& offsets, double& size) const {
  double most = 0.0;
  const auto add = [&](int column, Eigen::Vector3d& to) {
    const Eigen::Map<const Eigen::Vector3d> change(change_.data() + column);
    most = std::max(most, change.norm());
    to += change;
  };
  for (std::size_t b = 0; b < file_.bones_m.size(); ++b) {
    if (columns_.bone[b] >= 0) add(columns_.bone[b], offsets.bones_m[b]);
  }
  for (std::size_t m = 0; m < file_.markers_m.size(); ++m) add(columns_.marker[m], offsets.markers_m[m]);
  size += change_[static_cast<std::size_t>(columns_.size_column)];
  return most;
}

}  // namespace mocap::bodyfit
