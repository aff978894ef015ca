#include "bodyfit/instant_equations.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <functional>

#include "base/expects.h"
#include "kinematics/algebra.h"
#include "kinematics/pose_fit.h"
#include "kinematics/rotation.h"

namespace mocap::bodyfit {
namespace {

using kinematics::cross_matrix;
using kinematics::squared;

constexpr double kSmallStep = 1e-6;  // m, rad: below this step a pose has converged; 1/50 of kConvergedOffset_m

constexpr int kMaxCommonPasses = 8;  // the residuals of inliers need two or three

AngleRange range_of(const Bone& bone, int axis) {
  return bone.rotation_limits[static_cast<std::size_t>(axis)].value_or(AngleRange{0.0, 0.0});
}

// Excess of the rotation vector `phi` over the joint's range, by axis.
Eigen::Vector3d range_excess(const Bone& bone, const Eigen::Vector3d& phi) {
  Eigen::Vector3d excess;
  for (int axis = 0; axis < 3; ++axis) {
    const AngleRange range = range_of(bone, axis);
    excess[axis] = phi[axis] - std::clamp(phi[axis], range.min_rad, range.max_rad);
  }
  return excess;
}

}  // namespace

OffsetColumns::OffsetColumns(const MarkerSet& set)
    : bone(set.skeleton.bones.size(), -1), marker(set.markers.size(), -1) {
  const auto& bones = set.skeleton.bones;
  // A bone, its markers, then its descendants: the columns of a limb are consecutive.
  const std::function<void(std::size_t)> assign_columns = [&](std::size_t b) {
    if (bones[b].parent >= 0) {
      bone[b] = count;
      count += 3;
    }
    for (std::size_t m = 0; m < set.markers.size(); ++m) {
      if (set.markers[m].bone != static_cast<int>(b)) continue;
      marker[m] = count;
      count += 3;
    }
    for (std::size_t child = b + 1; child < bones.size(); ++child) {
      if (bones[child].parent == static_cast<int>(b)) assign_columns(child);
    }
  };
  if (!bones.empty()) assign_columns(0);
  size_column = count++;
}

InstantEquations::InstantEquations(const MarkerSet& set) : bones_(set.skeleton.bones), columns_(set) {
  MOCAP_EXPECTS(!bones_.empty() && bones_[0].parent < 0);
  marker_counts_.resize(bones_.size());
  for (const MarkerOnBone& marker : set.markers) {
    MOCAP_EXPECTS(marker.bone >= 0 && marker.bone < static_cast<int>(bones_.size()));
    bone_of_.push_back(marker.bone);
    ++marker_counts_[static_cast<std::size_t>(marker.bone)];
  }
  above_.resize(nodes());
  for (std::size_t n = 1; n < nodes(); ++n) {
    const int parent = bones_[n - 1].parent;
    MOCAP_EXPECTS(parent < static_cast<int>(n) - 1 && (parent >= 0 || n == 1));
    above_[n] = {static_cast<std::size_t>(parent + 1)};
    const auto& further = above_[static_cast<std::size_t>(parent + 1)];
    above_[n].insert(above_[n].end(), further.begin(), further.end());
  }
  list_runs();
  world_.resize(bones_.size());
  previous_locals_.resize(bones_.size());
  moments_.resize(bones_.size());
  common_.resize(bones_.size());
  places_.resize(bone_of_.size());
  weights_.resize(bone_of_.size());
  off_.resize(bone_of_.size());
  matrix_.resize(nodes() * nodes());
  factor_.resize(matrix_.size());
  gradient_.resize(nodes());
  step_.resize(nodes());
  rows_.resize(nodes() * 3 * static_cast<std::size_t>(columns_.count));
}

// A node is coupled with the markers of its descendants and with the rest offsets of its ancestors and descendants.
void InstantEquations::list_runs() {
  runs_.resize(nodes());
  for (std::size_t n = 0; n < nodes(); ++n) {
    const auto related = [&](std::size_t a, std::size_t b) {
      return a == b || std::find(above_[a].begin(), above_[a].end(), b) != above_[a].end();
    };
    std::vector<int> firsts;
    for (std::size_t b = 0; b < bones_.size(); ++b) {
      if (columns_.bone[b] >= 0 && (related(n, b + 1) || related(b + 1, n))) firsts.push_back(columns_.bone[b]);
    }
    for (std::size_t m = 0; m < bone_of_.size(); ++m) {
      if (related(static_cast<std::size_t>(bone_of_[m]) + 1, n)) firsts.push_back(columns_.marker[m]);
    }
    std::sort(firsts.begin(), firsts.end());
    for (const int first : firsts) {
      if (!runs_[n].empty() && runs_[n].back().end == first) {
        runs_[n].back().end += 3;
      } else {
        runs_[n].push_back({first, first + 3});
      }
    }
  }
}

void InstantEquations::pose(const BodyInstant& instant, const BodyOffsets& offsets) {
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    const int parent = bones_[b].parent;
    const Pose& local = instant.locals[b];
    world_[b] =
        parent < 0 ? local : world_[static_cast<std::size_t>(parent)] * Pose{offsets.bones_m[b], local.rotation};
    world_[b].rotation.normalize();
  }
}

// Positions and residuals of the measured markers.
void InstantEquations::place_markers(const BodyInstant& instant, const BodyOffsets& offsets) {
  for (std::size_t m = 0; m < places_.size(); ++m) {
    places_[m] = world_[static_cast<std::size_t>(bone_of_[m])] * offsets.markers_m[m];
    const bool measured = instant.seen_m[m].allFinite() && instant.trust[m] > 0.0;
    off_[m] = measured ? Eigen::Vector3d(places_[m] - instant.seen_m[m]) : Eigen::Vector3d::Zero();
    weights_[m] = measured ? marker_scale_ * instant.trust[m] : 0.0;
  }
}

// The displacement that the markers of each bone have in common, and the weights of the markers about it: the minimum
// of the robust cost, by iteratively reweighted least squares.
void InstantEquations::estimate_common_motion(const BodyInstant& instant, const InstantCost& by) {
  const double c = squared(by.outlier_m);
  const double prior = marker_scale_ / by.common_variance;
  for (CommonMotion& common : common_) common = {};
  double change_m2 = 0.0;
  for (int pass = 0; pass < kMaxCommonPasses && (pass == 0 || change_m2 > squared(kSmallStep)); ++pass) {
    for (CommonMotion& common : common_) common.weight = 0.0, common.force.setZero();
    for (std::size_t m = 0; m < places_.size(); ++m) {
      if (weights_[m] == 0.0) continue;
      CommonMotion& common = common_[static_cast<std::size_t>(bone_of_[m])];
      const double s = (off_[m] - common.displacement).squaredNorm();
      weights_[m] = marker_scale_ * instant.trust[m] * squared(c / (c + s));  // Geman and McClure
      common.weight += weights_[m];
      common.force += weights_[m] * off_[m];
    }
    change_m2 = 0.0;
    for (std::size_t b = 0; b < common_.size(); ++b) {
      if (marker_counts_[b] < 2) continue;
      CommonMotion& common = common_[b];
      const Eigen::Vector3d before = common.displacement;
      common.displacement = common.force / (common.weight + prior);
      common.share = common.weight / (common.weight + prior);
      change_m2 = std::max(change_m2, (common.displacement - before).squaredNorm());
    }
  }
}

// The markers of a bone share a displacement with zero mean and variance s^2. Let W be the total weight and x the mean
// position of the markers of the bone. Marginalising over the displacement subtracts one virtual marker from all sums:
// at x, with the mean residual and the weight W^2 / (W + 1/s^2).
InstantEquations::PoseCost InstantEquations::accumulate_markers(const BodyInstant& instant, const BodyOffsets& offsets,
                                                                const InstantCost& by) {
  marker_scale_ = 1.0 / squared(by.sigma_m);
  place_markers(instant, offsets);
  estimate_common_motion(instant, by);
  PoseCost pose_cost;
  const double c = squared(by.outlier_m);
  for (Moments& moments : moments_) moments = {};
  for (CommonMotion& common : common_) {
    common.at.setZero();
    pose_cost.data_m2 += common.displacement.squaredNorm() / by.common_variance;
  }
  for (std::size_t m = 0; m < places_.size(); ++m) {
    if (weights_[m] == 0.0) continue;
    const auto bone = static_cast<std::size_t>(bone_of_[m]);
    CommonMotion& common = common_[bone];
    const Eigen::Vector3d off = off_[m] - common.displacement;
    const double s = off.squaredNorm();
    pose_cost.data_m2 += instant.trust[m] * s * c / (c + s);
    pose_cost.weight += weights_[m] / marker_scale_;
    Moments& moments = moments_[bone];
    const Eigen::Vector3d at = places_[m] - world_[0].position;
    common.at += weights_[m] / common.weight * at;
    moments.weight += weights_[m];
    moments.first += weights_[m] * at;
    moments.second += weights_[m] * at * at.transpose();
    moments.force += weights_[m] * off;
    moments.torque += weights_[m] * at.cross(off);
  }
  for (std::size_t b = bones_.size(); b-- > 0;) {
    const CommonMotion& common = common_[b];
    const double taken = common.weight * common.share;
    moments_[b].weight -= taken;
    moments_[b].first -= taken * common.at;
    moments_[b].second -= taken * common.at * common.at.transpose();
    if (b == 0) break;
    Moments& parent = moments_[static_cast<std::size_t>(bones_[b].parent)];
    parent.weight += moments_[b].weight;
    parent.first += moments_[b].first;
    parent.second += moments_[b].second;
    parent.force += moments_[b].force;
    parent.torque += moments_[b].torque;
  }
  return pose_cost;
}

double InstantEquations::accumulate_joint_priors(const BodyInstant& instant, const InstantCost& by) {
  double prior = 0.0;
  for (std::size_t b = 1; b < bones_.size(); ++b) {
    const Eigen::Vector3d phi = kinematics::rotation_vector(instant.locals[b].rotation);
    const Eigen::Vector3d excess = range_excess(bones_[b], phi);
    const double rest = 1.0 / squared(instant.at_rest[b] != 0 ? by.at_rest_sigma_rad : by.rest_sigma_rad);
    const double limit = 1.0 / squared(by.limit_sigma_rad);
    prior += rest * phi.squaredNorm() + limit * excess.squaredNorm();
    Eigen::Vector3d weight = Eigen::Vector3d::Constant(rest);
    for (int axis = 0; axis < 3; ++axis) weight[axis] += excess[axis] == 0.0 ? 0.0 : limit;
    const Eigen::Vector3d force = rest * phi + limit * excess;
    // The unknowns are rotations about the world's axes.
    const Eigen::Matrix3d change =
        kinematics::inverse_left_jacobian(phi) *
        world_[static_cast<std::size_t>(bones_[b].parent)].rotation.toRotationMatrix().transpose();
    block(b + 1, b + 1) += change.transpose() * weight.asDiagonal() * change;
    gradient_[b + 1] += change.transpose() * force;
  }
  return prior;
}

double InstantEquations::accumulate_tilt_prior(const BodyInstant& instant, const InstantCost& by) {
  if (instant.at_rest[0] == 0) return 0.0;
  const Eigen::Vector3d up = world_[0].rotation * Eigen::Vector3d::UnitZ();
  const double weight = 1.0 / squared(by.upright_sigma_rad);
  const Eigen::Matrix<double, 2, 3> change = (-cross_matrix(up)).topRows<2>();
  block(1, 1) += weight * change.transpose() * change;
  gradient_[1] += weight * change.transpose() * up.head<2>();
  return weight * up.head<2>().squaredNorm();
}

InstantEquations::PoseCost InstantEquations::linearise(const BodyInstant& instant, const BodyOffsets& offsets,
                                                       const InstantCost& by) {
  pose(instant, offsets);
  PoseCost pose_cost = accumulate_markers(instant, offsets, by);
  block(0, 0) = moments_[0].weight * Eigen::Matrix3d::Identity();
  gradient_[0] = moments_[0].force;
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    const Moments& of = moments_[b];
    const Eigen::Vector3d joint = world_[b].position - world_[0].position;
    gradient_[b + 1] = of.torque - joint.cross(of.force);
    block(b + 1, 0) = cross_matrix(of.first - of.weight * joint);
    for (int above = static_cast<int>(b); above >= 0; above = bones_[static_cast<std::size_t>(above)].parent) {
      // The sum of w (x - p) (x - q)^T over the markers x below both joints p and q.
      const Eigen::Vector3d other = world_[static_cast<std::size_t>(above)].position - world_[0].position;
      const Eigen::Matrix3d levers = of.second - joint * of.first.transpose() - of.first * other.transpose() +
                                     of.weight * joint * other.transpose();
      block(b + 1, static_cast<std::size_t>(above) + 1) =
          levers.trace() * Eigen::Matrix3d::Identity() - levers.transpose();
    }
  }
  pose_cost.prior = accumulate_joint_priors(instant, by) + accumulate_tilt_prior(instant, by);
  return pose_cost;
}

bool InstantEquations::factor(double damping) {
  for (std::size_t n = 0; n < nodes(); ++n) {
    factor_[n * nodes() + n] = block(n, n);
    factor_[n * nodes() + n].diagonal() *= 1.0 + damping;
    factor_[n * nodes() + n].diagonal().array() += 1e-9;
    for (const std::size_t a : above_[n]) factor_[n * nodes() + a] = block(n, a);
  }
  for (std::size_t n = nodes(); n-- > 0;) {
    // H_nn = U U^T with U upper triangular, stored as L_nn = U^T. Then H = L^T L in blocks.
    Eigen::Matrix3d& own = factor_[n * nodes() + n];
    const Eigen::Matrix3d reversed = own.reverse();
    const Eigen::LLT<Eigen::Matrix3d> llt(reversed);
    if (llt.info() != Eigen::Success) return false;
    const Eigen::Matrix3d lower = llt.matrixL();
    const Eigen::Matrix3d upper = lower.reverse();
    own = upper.transpose();
    if (!own.allFinite()) return false;
    for (const std::size_t a : above_[n]) {
      Eigen::Matrix3d& to = factor_[n * nodes() + a];
      to = upper.triangularView<Eigen::Upper>().solve(to);
    }
    for (std::size_t i = 0; i < above_[n].size(); ++i) {
      for (std::size_t j = i; j < above_[n].size(); ++j) {
        const std::size_t lower_node = above_[n][i], upper_node = above_[n][j];
        factor_[lower_node * nodes() + upper_node] -= factored(n, lower_node).transpose() * factored(n, upper_node);
      }
    }
  }
  return true;
}

// Solves H step = -g with H = L^T L: first from the leaves to the root, then from the root to the leaves.
void InstantEquations::solve_step() {
  for (std::size_t n = 0; n < nodes(); ++n) step_[n] = -gradient_[n];
  for (std::size_t n = nodes(); n-- > 0;) {
    step_[n] = factored(n, n).transpose().triangularView<Eigen::Upper>().solve(step_[n]);
    for (const std::size_t a : above_[n]) step_[a] -= factored(n, a).transpose() * step_[n];
  }
  for (std::size_t n = 0; n < nodes(); ++n) {
    for (const std::size_t a : above_[n]) step_[n] -= factored(n, a) * step_[a];
    step_[n] = factored(n, n).triangularView<Eigen::Lower>().solve(step_[n]);
  }
}

void InstantEquations::apply_step(BodyInstant& instant) const {
  instant.locals[0].position += step_[0];
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    const int parent = bones_[b].parent;
    const Eigen::Vector3d rotation =
        parent < 0 ? step_[b + 1]
                   : Eigen::Vector3d(world_[static_cast<std::size_t>(parent)].rotation.conjugate() * step_[b + 1]);
    instant.locals[b].rotation = (kinematics::from_rotation_vector(rotation) * instant.locals[b].rotation).normalized();
  }
}

InstantEquations::PoseCost InstantEquations::optimise_pose(BodyInstant& instant, const BodyOffsets& offsets,
                                                           const InstantCost& by, int steps) {
  PoseCost best = linearise(instant, offsets, by);
  double damping = kinematics::kInitialDamping;
  while (steps-- > 0 && damping <= kinematics::kMaxDamping) {
    if (!factor(damping)) {
      damping *= 10.0;
      continue;
    }
    solve_step();
    double most = 0.0;
    for (const Eigen::Vector3d& step : step_) most = std::max(most, step.cwiseAbs().maxCoeff());
    if (most < kSmallStep) break;
    std::copy(instant.locals.begin(), instant.locals.end(), previous_locals_.begin());
    apply_step(instant);
    const PoseCost moved = linearise(instant, offsets, by);
    if (moved.cost(by) <= best.cost(by)) {  // false if NaN
      best = moved;
      damping = std::max(kinematics::kInitialDamping, 0.1 * damping);
    } else {
      std::copy(previous_locals_.begin(), previous_locals_.end(), instant.locals.begin());
      best = linearise(instant, offsets, by);
      damping = std::max(1e-3, 10.0 * damping);
    }
  }
  return best;
}

}  // namespace mocap::bodyfit
