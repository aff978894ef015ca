// SkeletonTracker, continued: the cost of a label hypothesis.

#include <algorithm>

#include "pose/skeleton_tracker.h"

namespace mocap::pose {
namespace {

// Initial standard deviation of a joint that no marker of its own bone observes. Chosen by hand; not yet measured.
constexpr double kDescendantSigma_rad = 0.05;
// Step that ends the fit of a hypothesis. Costs of competing hypotheses differ by far more than such a step changes
// them. Chosen by hand; not yet measured.
constexpr double kHypothesisConvergedStep = 5e-3;

}  // namespace

kinematics::PoseFitResult SkeletonTracker::evaluate_hypothesis(std::span<const kinematics::Observation> seen,
                                                               double max_cost) {
  pose_.set_locals(fitted_);
  return evaluate_from_current(seen, max_cost);
}

kinematics::PoseFitResult SkeletonTracker::evaluate_from(std::span<const Pose> locals,
                                                         std::span<const MarkerSwing> swings,
                                                         std::span<const kinematics::Observation> seen,
                                                         double max_cost) {
  pose_.set_locals(locals);
  for (const MarkerSwing& swing : swings) {
    const auto marker = static_cast<std::size_t>(swing.marker);
    const int bone = pose_.marker_set().markers[marker].bone;
    swing_marker_to(static_cast<std::size_t>(bone), marker,
                    pose_.marker_at(static_cast<std::size_t>(swing.onto_marker)));
  }
  return evaluate_from_current(seen, max_cost);
}

// Fits from the current pose. The prior is always around the pose of the last fit, wherever the search begins.
kinematics::PoseFitResult SkeletonTracker::evaluate_from_current(std::span<const kinematics::Observation> seen,
                                                                 double max_cost) {
  relax_prior(seen, at_);
  const kinematics::PoseFitEnd end{.max_iterations = 2 * settings_.max_iterations,
                                   .small_step = kHypothesisConvergedStep};
  kinematics::PosePrior prior = make_prior(seen.size());
  prior.prior_pose = fitted_;
  return solve(seen, prior, end, max_cost);
}

// Fits from the current pose twice, with the prior around `prior.prior_pose` and around the start itself, and keeps the
// fit of lower cost. Recorded hands rotate by 55 degrees from frame to frame, and sets may be missing, so a limb may be
// far from the prior pose (decision 0013).
kinematics::PoseFitResult SkeletonTracker::solve_with_and_without_prior_pose(
    std::span<const kinematics::Observation> seen, const kinematics::PosePrior& prior,
    const kinematics::PoseFitEnd& end) {
  std::copy(pose_.locals().begin(), pose_.locals().end(), start_pose_.begin());
  const kinematics::PoseFitResult with_prior = pose_.solve(seen, prior, end);
  if (prior.prior_pose.empty()) return with_prior;
  std::copy(pose_.locals().begin(), pose_.locals().end(), trial_pose_.begin());
  pose_.set_locals(start_pose_);
  kinematics::PosePrior around_start = prior;
  around_start.prior_pose = {};
  const kinematics::PoseFitResult without_prior = pose_.solve(seen, around_start, end);
  if (without_prior.cost < with_prior.cost) return without_prior;
  pose_.set_locals(trial_pose_);
  return with_prior;
}

// Sets the prior of all joints to the covariance that they have drifted to since they were observed.
void SkeletonTracker::relax_prior(std::span<const kinematics::Observation> seen, Timestamp at) {
  update_observability(seen);
  for (std::size_t b = 0; b < bones_.size(); ++b) {
    const double initial_sigma_rad =
        bones_[b].observability == Observability::Full ? kMotionSigma_rad : kDescendantSigma_rad;
    // A bone with own markers was observed in this set. All others drift on from the last commit.
    const double ahead_s = bones_[b].observability == Observability::Full ? 0.0 : to_s(at - committed_at_);
    prior_information_[b] =
        unreliable_[b] != 0 ? Eigen::Matrix3d(Eigen::Matrix3d::Identity() / (kMaxJointDrift_rad * kMaxJointDrift_rad))
                            : joint_drift_.prior_information(b, initial_sigma_rad, ahead_s);
  }
}

}  // namespace mocap::pose
