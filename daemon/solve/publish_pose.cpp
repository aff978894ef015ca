// SubjectSolver, continued: the published pose.

#include <algorithm>
#include <cmath>
#include <numbers>

#include "kinematics/rotation.h"
#include "solve/subject_solver.h"

namespace mocap::solve {
namespace {

// Time after a change of the observing markers in which a jump of the pose is eased: the labeller may need as long to
// label a limb whose markers reappeared. Chosen by hand; not yet measured.
constexpr double kTransitionTime_s = 0.1;
// Time constant of the published velocities, and the gap between sets after which they start at zero. Chosen by hand;
// not yet measured.
constexpr double kVelocityTimeConstant_s = 0.02;
constexpr double kMaxVelocityGap_s = 0.25;
// A bone's confidence is the probability that its joint and a point at the lever's length from the joint are within
// this radius of their true positions.
constexpr double kConfidenceRadius_m = 0.03;
constexpr double kConfidenceLever_m = 0.1;

// Probability that a point with a normal error of `sigma` on each of three axes is within `r` of its mean: the chi
// distribution with three degrees of freedom.
double probability_within(double r, double sigma) {
  const double x = r / std::max(sigma, 1e-9);
  if (x > 6.0) return 1.0;
  return std::erf(x / std::numbers::sqrt2) - std::sqrt(2.0 / std::numbers::pi) * x * std::exp(-0.5 * x * x);
}

}  // namespace

// Marks the bones that other markers observe than before, within the transition time, and their neighbours up to the
// second.
void SubjectSolver::detect_observation_changes(Timestamp at) {
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    BoneMemory& bone = bones_[b];
    const bool changed = bone.markers != bone.markers_now;
    if (is_first_set_) bone.changed_at = at - 2 * from_s(kTransitionTime_s);
    if (changed && !is_first_set_) bone.changed_at = at;
    bone.markers = bone.markers_now;
    changed_[b] = to_s(at - bone.changed_at) <= kTransitionTime_s ? 1 : 0;
  }
  for (int reach = 0; reach < 2; ++reach) {
    std::copy(changed_.begin(), changed_.end(), changed_neighbours_.begin());
    for (std::size_t b = 1; b < bones_.size(); ++b) {
      if (parents_[b] < 0) continue;
      const auto parent = static_cast<std::size_t>(parents_[b]);
      changed_neighbours_[b] |= changed_[parent];
      changed_neighbours_[parent] |= changed_[b];
    }
    changed_.swap(changed_neighbours_);
  }
}

// Whether half of the bone's markers are measured. A bone without markers is observed if its parent has a measured
// marker and its own rotation is observable.
bool SubjectSolver::is_bone_observed(std::size_t bone) const {
  if (own_markers_[bone] > 0) return 2 * seen_markers_[bone] >= own_markers_[bone];
  const int parent = parents_[bone];
  return parent >= 0 && seen_markers_[static_cast<std::size_t>(parent)] > 0 &&
         body_.bone_observability(bone) != pose::SkeletonTracker::Observability::None;
}

// The variance of the point at the lever's length is that of the joint plus two thirds of the rotation's times the
// lever squared: of three axes, two move the point.
float SubjectSolver::confidence_of(std::size_t bone) const {
  if (!pose_is_observable_) return 0.0F;
  const double place_m2 = body_.pose().joint_covariance(bone).trace() / 3.0;
  const double rotation_rad2 = !rotation_is_visible_[bone] ? 0.0 : body_.pose().rotation_covariance(bone).trace() / 3.0;
  const double sigma_m = std::sqrt(place_m2 + kConfidenceLever_m * kConfidenceLever_m * 2.0 / 3.0 * rotation_rad2 +
                                   std::pow(body_.residual_m(), 2) / 3.0);
  return std::isfinite(sigma_m) ? static_cast<float>(probability_within(kConfidenceRadius_m, sigma_m)) : 0.0F;
}

// Velocities of a published bone: low-pass filtered differences of its poses.
void SubjectSolver::update_motion(BoneMemory& memory, const Eigen::Quaterniond& previous_rotation, double step_s,
                                  BonePose& bone) const {
  const Pose& now = bone.world_from_bone;
  if (is_first_set_ || step_s > kMaxVelocityGap_s) {
    memory.velocity_m_s.setZero();
    memory.spin_rad_s.setZero();
  } else if (step_s > 0.0) {
    const double share = 1.0 - std::exp(-step_s / kVelocityTimeConstant_s);
    const Eigen::Vector3d rotation = kinematics::rotation_vector(now.rotation * previous_rotation.conjugate());
    memory.velocity_m_s += share * ((now.position - memory.position) / step_s - memory.velocity_m_s);
    memory.spin_rad_s += share * (rotation / step_s - memory.spin_rad_s);
  }
  memory.position = now.position;
  bone.velocity_m_s = memory.velocity_m_s;
  bone.spin_rad_s = memory.spin_rad_s;
}

// Eases and smooths the local poses of the fit, and publishes them with world poses, velocities and confidences.
void SubjectSolver::write_pose(Timestamp at, SubjectPose& into) {
  const double step_s = is_first_set_ ? 0.0 : to_s(at - published_at_);
  detect_observation_changes(at);
  if (is_first_set_ || step_s > kMaxVelocityGap_s) {
    transition_smoother_.reset();
    smoother_.reset();
  }
  if (refitted_) std::fill(changed_.begin(), changed_.end(), std::uint8_t{1});
  const std::span<const Pose> before =
      refitted_ ? std::span<const Pose>(locals_before_refit_) : body_.predicted_locals();
  const std::span<const Pose> eased = transition_smoother_.step(body_.pose().locals(), before, changed_, step_s);
  refitted_ = false;
  const std::span<const Pose> locals = smoother_.step(eased, step_s);
  into.residual_m = body_.residual_m();
  into.smoothing_delay_s = smoother_.delay_s();
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    BoneMemory& memory = bones_[b];
    world_[b] = parents_[b] < 0 ? locals[b] : world_[static_cast<std::size_t>(parents_[b])] * locals[b];
    world_[b].rotation.normalize();
    const Eigen::Quaterniond previous_rotation = memory.published_world;
    memory.published_world = kinematics::same_hemisphere(world_[b].rotation, memory.published_world);
    memory.published_local = kinematics::same_hemisphere(locals[b].rotation, memory.published_local);
    BonePose& bone = into.bones.push_back({});
    bone.world_from_bone = {world_[b].position, memory.published_world};
    bone.parent_from_bone = {locals[b].position, memory.published_local};
    update_motion(memory, previous_rotation, step_s, bone);
    bone.state = is_bone_observed(b) ? BoneState::Measured : BoneState::Filled;
    bone.confidence = confidence_of(b);
  }
  published_at_ = at;
  is_first_set_ = false;
}

}  // namespace mocap::solve
