#include "kinematics/pose_fit.h"

#include <algorithm>
#include <cmath>

#include "base/expects.h"
#include "kinematics/algebra.h"
#include "kinematics/archive_body.h"
#include "kinematics/rotation.h"

namespace mocap::kinematics {
namespace {

constexpr std::size_t kUnusable = static_cast<std::size_t>(-1);

std::vector<TreeEquations::Link> links_of(const Skeleton& skeleton, PoseFit::Lengths lengths) {
  std::vector<TreeEquations::Link> links;
  for (const Bone& bone : skeleton.bones)
    links.push_back({bone.parent, bone.parent < 0 || lengths == PoseFit::Lengths::Free});
  return links;
}

}  // namespace

PoseFit::PoseFit(const MarkerSet& set, Lengths lengths)
    : set_(set), equations_(links_of(set.skeleton, lengths)), free_lengths_(lengths == Lengths::Free) {
  const std::size_t bones = set_.skeleton.bones.size();
  for (const Bone& bone : set_.skeleton.bones) {
    parents_.push_back(bone.parent);
    joints_.emplace_back(bone, bone.parent < 0);
    model_offsets_.push_back(bone.rest_offset_m);
  }
  for (const MarkerOnBone& marker : set_.markers)
    MOCAP_EXPECTS(marker.bone >= 0 && marker.bone < static_cast<int>(bones));
  locals_.resize(bones);
  world_.resize(bones);
  world_rotations_.resize(bones);
  prior_pose_.resize(bones);
  previous_locals_.resize(bones);
  residuals_.resize(set_.markers.size());
  place({});
}

void PoseFit::refit(std::span<const Eigen::Vector3d> rest_offsets_m,
                    std::span<const Eigen::Vector3d> marker_offsets_m) {
  MOCAP_EXPECTS(rest_offsets_m.size() == locals_.size() && marker_offsets_m.size() == set_.markers.size());
  for (std::size_t b = 0; b < locals_.size(); ++b) {
    set_.skeleton.bones[b].rest_offset_m = rest_offsets_m[b];
    model_offsets_[b] = rest_offsets_m[b];
    if (parents_[b] >= 0) locals_[b].position = rest_offsets_m[b];
  }
  for (std::size_t m = 0; m < set_.markers.size(); ++m) set_.markers[m].offset_m = marker_offsets_m[m];
  scale_ = 1.0;
  update_world();
}

void PoseFit::archive(Archive& members) {
  archive_offsets(set_, members);
  for (JointPrior& joint : joints_) members(joint);
  members(equations_, locals_, model_offsets_, scale_);
  if (members.is_reading()) update_world();
}

void PoseFit::place(const Pose& world_from_root, double scale) {
  scale_ = scale;
  for (std::size_t b = 0; b < locals_.size(); ++b) {
    model_offsets_[b] = scale * set_.skeleton.bones[b].rest_offset_m;
    locals_[b] = parents_[b] < 0 ? world_from_root : Pose{model_offsets_[b], Eigen::Quaterniond::Identity()};
  }
  update_world();
}

void PoseFit::set_locals(std::span<const Pose> locals) {
  MOCAP_EXPECTS(locals.size() == locals_.size());
  for (std::size_t b = 0; b < locals_.size(); ++b) {
    if (parents_[b] < 0) locals_[b].position = locals[b].position;
    locals_[b].rotation = locals[b].rotation;
  }
  update_world();
}

Eigen::Vector3d PoseFit::marker_at(std::size_t marker) const {
  const MarkerOnBone& on = set_.markers[marker];
  const auto bone = static_cast<std::size_t>(on.bone);
  return world_rotations_[bone] * (scale_ * on.offset_m) + world_[bone].position;
}

void PoseFit::update_world() {
  for (std::size_t b = 0; b < locals_.size(); ++b) {
    if (parents_[b] < 0) {
      world_[b] = locals_[b];
    } else {
      const auto parent = static_cast<std::size_t>(parents_[b]);
      world_[b].position = world_rotations_[parent] * locals_[b].position + world_[parent].position;
      world_[b].rotation = world_[parent].rotation * locals_[b].rotation;
    }
    world_[b].rotation.normalize();
    world_rotations_[b] = world_[b].rotation.toRotationMatrix();
  }
}

void PoseFit::begin(std::span<const Observation> seen, const PosePrior& prior) {
  MOCAP_EXPECTS(prior.prior_sigma_rad.empty() || prior.prior_sigma_rad.size() == locals_.size());
  MOCAP_EXPECTS(prior.prior_information.empty() || prior.prior_information.size() == locals_.size());
  MOCAP_EXPECTS(prior.rest_confidence.empty() || prior.rest_confidence.size() == locals_.size());
  MOCAP_EXPECTS(prior.limit_confidence.empty() || prior.limit_confidence.size() == locals_.size());
  MOCAP_EXPECTS(prior.prior_pose.empty() || prior.prior_pose.size() == locals_.size());
  std::ranges::copy(prior.prior_pose.empty() ? std::span<const Pose>(locals_) : prior.prior_pose, prior_pose_.begin());
  for (std::size_t b = 0; b < joints_.size(); ++b) joints_[b].set(prior, b);
  if (seen.size() > residuals_.size()) residuals_.resize(seen.size());
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const auto marker = static_cast<std::size_t>(seen[i].marker);
    residuals_[i].bone = is_usable(seen[i]) ? static_cast<std::size_t>(set_.markers[marker].bone) : kUnusable;
  }
}

// Returns twice the robust cost of Geman and McClure: quadratic in the normalised residual for small residuals, bounded
// by (outlier_m / sigma)^2 for large ones.
double PoseFit::evaluate(const Observation& seen, double outlier_m, Residual& into) const {
  const MarkerOnBone& on = set_.markers[static_cast<std::size_t>(seen.marker)];
  into.lever = world_rotations_[into.bone] * (scale_ * on.offset_m);
  into.error = world_[into.bone].position + into.lever - seen.position;
  const double information = information_1_m2(seen);
  const bool isotropic = seen.weight_1_m2.trace() == 0.0;
  const double cost =
      isotropic ? information * into.error.squaredNorm() : into.error.dot(seen.weight_1_m2 * into.error);
  const double max_cost = information * squared(outlier_m);
  const double robust_factor = max_cost / (max_cost + cost);
  into.robust_weight = squared(robust_factor);
  return cost * robust_factor;
}

// Returns half the sum of squares of the current pose, and prepares what `assemble` needs.
double PoseFit::evaluate(std::span<const Observation> seen, const PosePrior& prior) {
  double sum = 0.0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (residuals_[i].bone != kUnusable) sum += evaluate(seen[i], prior.outlier_m, residuals_[i]);
  }
  for (std::size_t b = 0; b < locals_.size(); ++b) {
    sum += joints_[b].evaluate(locals_[b].rotation, prior_pose_[b].rotation);
    if (parents_[b] < 0 && has_prior_pose(prior)) {
      sum += (locals_[b].position - prior_pose_[b].position).squaredNorm() / squared(prior.prior_root_sigma_m);
    } else if (parents_[b] >= 0 && free_lengths_) {
      const Eigen::Vector3d error = locals_[b].position - model_offsets_[b];
      sum += error.dot(offset_information(model_offsets_[b], prior) * error);
    }
  }
  return 0.5 * sum;
}

// Writes the Gauss-Newton equations of the pose that was evaluated last.
void PoseFit::assemble(std::span<const Observation> seen, const PosePrior& prior) {
  const Eigen::Matrix3d identity = Eigen::Matrix3d::Identity();
  for (std::size_t b = 0; b < locals_.size(); ++b) {
    equations_.joint(b) = world_[b].position;
    equations_.bone(b) = {};
    const Eigen::Matrix3d& parent =
        parents_[b] < 0 ? identity : world_rotations_[static_cast<std::size_t>(parents_[b])];
    joints_[b].add(parent, equations_.rotation(b));
    JointTerms& translation = equations_.translation(b);
    translation.axes = parent;
    if (parents_[b] >= 0) {
      if (!free_lengths_) continue;
      translation.weight = offset_information(model_offsets_[b], prior);
      translation.gradient = translation.weight * (locals_[b].position - model_offsets_[b]);
    } else {
      const double root_information = has_prior_pose(prior) ? 1.0 / squared(prior.prior_root_sigma_m) : 0.0;
      translation.weight = root_information * identity;
      translation.gradient = root_information * (locals_[b].position - prior_pose_[b].position);
    }
  }
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const Residual& one = residuals_[i];
    if (one.bone == kUnusable) continue;
    if (seen[i].weight_1_m2.trace() == 0.0) {
      equations_.bone(one.bone).add_point(one.lever, one.robust_weight / squared(seen[i].sigma_m), one.error);
    } else {
      equations_.bone(one.bone).add_point(one.lever, one.robust_weight * seen[i].weight_1_m2, one.error);
    }
  }
}

void PoseFit::step() {
  for (std::size_t b = 0; b < locals_.size(); ++b) {
    if (parents_[b] < 0 || free_lengths_) locals_[b].position += equations_.translation_step(b);
    locals_[b].rotation = joints_[b].apply_step(locals_[b].rotation, equations_.rotation_step(b));
  }
  update_world();
}

bool PoseFit::step_is_small(double small) const {
  for (std::size_t b = 0; b < locals_.size(); ++b) {
    if (!(equations_.rotation_step(b).lpNorm<Eigen::Infinity>() < small)) return false;
    if (!(equations_.translation_step(b).lpNorm<Eigen::Infinity>() < small)) return false;
  }
  return true;
}

double PoseFit::rms_of(std::span<const Observation> seen) const {
  double sum = 0.0;
  int count = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (residuals_[i].bone == kUnusable || seen[i].bearing_only || seen[i].is_ambiguous) continue;
    sum += (marker_at(static_cast<std::size_t>(seen[i].marker)) - seen[i].position).squaredNorm();
    ++count;
  }
  return count == 0 ? 0.0 : std::sqrt(sum / count);
}

bool PoseFit::compute_covariances(std::span<const Observation> seen, const PosePrior& prior) {
  begin(seen, prior);
  (void)evaluate(seen, prior);
  assemble(seen, prior);
  return equations_.compute_covariances();
}

Eigen::Matrix3d PoseFit::covariance_of(std::size_t marker) const {
  const auto bone = static_cast<std::size_t>(set_.markers[marker].bone);
  return equations_.covariance_of(bone, marker_at(marker) - world_[bone].position);
}

Eigen::Matrix3d PoseFit::joint_covariance(std::size_t bone) const {
  return equations_.covariance_of(bone, Eigen::Vector3d::Zero());
}

PoseFitResult PoseFit::solve(std::span<const Observation> seen, const PosePrior& prior, const PoseFitEnd& end) {
  for (std::size_t b = 0; b < locals_.size(); ++b)
    locals_[b].rotation = joints_[b].project_to_free_axes(locals_[b].rotation);
  update_world();
  begin(seen, prior);
  PoseFitResult result;
  result.cost = evaluate(seen, prior);
  double damping = kInitialDamping;
  while (result.iterations < end.max_iterations && !result.converged) {
    ++result.iterations;
    assemble(seen, prior);
    std::copy(locals_.begin(), locals_.end(), previous_locals_.begin());
    bool better = false;
    while (!better && damping <= kMaxDamping) {
      if (equations_.solve(damping)) {
        step();
        const double cost = evaluate(seen, prior);
        better = cost <= result.cost;  // false for NaN, too
        if (better) result.cost = cost;
      }
      if (!better) {
        std::copy(previous_locals_.begin(), previous_locals_.end(), locals_.begin());
        update_world();
        damping *= 10.0;
      }
    }
    damping = std::max(kInitialDamping, damping * 0.1);
    result.converged = !better || step_is_small(end.small_step);
  }
  result.rms_m = rms_of(seen);
  return result;
}

}  // namespace mocap::kinematics
