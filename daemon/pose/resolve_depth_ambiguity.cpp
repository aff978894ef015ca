// SkeletonTracker, continued: which of the two points where a ray meets the reach sphere of a limb is right.

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "kinematics/kinematic_tree.h"
#include "kinematics/rotation.h"
#include "pose/skeleton_tracker.h"

namespace mocap::pose {
namespace {

// Cost by which the other branch must be better, in half squared standard deviations. Chosen by hand; not yet measured.
constexpr double kDepthCostMargin = 2.0;
// Initial standard deviation of the joints of the limb, to compare both branches: a joint observed in the last set may
// differ this much from its prediction. Chosen by hand; not yet measured.
constexpr double kRecentSigma_rad = 0.3;
// Smallest standard deviation of a limb's reach. Branches at least kDistinctBranch_m from the middle of the chord
// require the full margin. Chosen by hand; not yet measured.
constexpr double kMinReachSigma_m = 5e-5;
constexpr double kDistinctBranch_m = 0.1;

}  // namespace

// The intersection of a ray with the sphere about a joint: two points at the same distance from the middle of the
// chord.
struct SkeletonTracker::RaySphereIntersection {
  Eigen::Vector3d middle;
  Eigen::Vector3d direction;
  double reach_m = 0.0;
  double half_chord_m2 = 0.0;  // negative if the ray passes outside the sphere

  // Outside, both points are the point of the ray nearest to the sphere.
  double half_chord_m() const { return std::sqrt(std::max(0.0, half_chord_m2)); }
};

// The sphere is centred at `joint` and passes through `marker`.
SkeletonTracker::RaySphereIntersection SkeletonTracker::intersect_reach_sphere(const kinematics::Observation& ray,
                                                                               const Eigen::Vector3d& joint,
                                                                               const Eigen::Vector3d& marker) {
  const Eigen::Matrix3d along = Eigen::Matrix3d::Identity() - ray.sigma_m * ray.sigma_m * ray.weight_1_m2;
  int most = 0;
  along.diagonal().maxCoeff(&most);
  const Eigen::Vector3d direction = along.col(most).normalized();
  const Eigen::Vector3d middle = ray.position + (joint - ray.position).dot(direction) * direction;
  const double reach_m = (marker - joint).norm();
  return {middle, direction, reach_m, reach_m * reach_m - (middle - joint).squaredNorm()};
}

// Examines each limb that one ray alone observes. A ray meets the reach sphere of a limb in two points. Small steps do
// not lead from one to the other, and where both are near each other the prediction may lead to the wrong one. The
// depth hypotheses and the joint priors decide (decisions 0009, 0012, 0014).
kinematics::PoseFitResult SkeletonTracker::resolve_depth_ambiguity(std::span<const kinematics::Observation> seen,
                                                                   const kinematics::PosePrior& prior,
                                                                   const kinematics::PoseFitEnd& end,
                                                                   kinematics::PoseFitResult first) {
  for (const kinematics::Observation& one : seen) {
    if (!one.bearing_only || !kinematics::is_usable(one)) continue;
    const int limb = find_bearing_only_limb(seen, one);
    if (limb < 0 || !reinitialise_limb(static_cast<std::size_t>(limb), one, seen, end.max_iterations)) continue;
    first = pose_.solve(seen, prior, end);
    for (std::size_t b = 0; b < is_below_.size(); ++b) reinitialised_[b] |= is_below_[b];
  }
  return first;
}

// Moves a limb to the likelier point of its ray. Returns false, with the pose unchanged, if it is there already.
bool SkeletonTracker::reinitialise_limb(std::size_t lower, const kinematics::Observation& ray,
                                        std::span<const kinematics::Observation> seen, int iterations) {
  const auto marker = static_cast<std::size_t>(ray.marker);
  std::copy(pose_.locals().begin(), pose_.locals().end(), fallback_pose_.begin());
  const Eigen::Vector3d place = pose_.marker_at(marker);
  straighten_below(lower);
  RaySphereIntersection intersection =
      intersect_reach_sphere(ray, pose_.world()[lower].position, pose_.marker_at(marker));
  // The sign of the direction is that of its largest component, which differs from set to set on a diagonal. The near
  // branch of the hypotheses must stay the near one.
  if (depth_hypotheses_[marker].follows(-intersection.direction, at_)) intersection.direction = -intersection.direction;
  const double depth_m = (place - intersection.middle).dot(intersection.direction);
  const bool reach_is_known = kinematics::sits_in_joint(pose_.marker_set().markers[marker]);
  if (reach_is_known) update_depth_hypotheses(marker, intersection, depth_m);
  const auto branch_cost = [&](double at_m) {
    return reach_is_known ? depth_hypotheses_[marker].cost(at_m < 0.0 ? DepthGaussianSum::Near : DepthGaussianSum::Far)
                          : 0.0;
  };
  pose_.set_locals(fallback_pose_);
  // A wrong choice between two branches that are near each other costs little.
  const double margin = reach_is_known
                            ? kDepthCostMargin * std::min(1.0, intersection.half_chord_m() / kDistinctBranch_m)
                            : kDepthCostMargin;
  double min_cost = evaluate_limb_cost(lower, seen, iterations) + branch_cost(depth_m) - margin;
  bool is_reinitialised = false;
  for (const double sign : {-1.0, 1.0}) {
    pose_.set_locals(straight_pose_);
    swing_marker_to(lower, marker, intersection.middle + sign * intersection.half_chord_m() * intersection.direction);
    const double cost = evaluate_limb_cost(lower, seen, iterations) + branch_cost(sign);
    if (!(cost < min_cost)) continue;
    min_cost = cost;
    is_reinitialised = true;
    std::copy(pose_.locals().begin(), pose_.locals().end(), fallback_pose_.begin());
  }
  pose_.set_locals(fallback_pose_);
  return is_reinitialised;
}

// Updates the Gaussian sum of a marker's depth. Only for a marker in the joint at the end of the limb, whose reach is
// known.
void SkeletonTracker::update_depth_hypotheses(std::size_t marker, const RaySphereIntersection& intersection,
                                              double depth_m) {
  DepthGaussianSum& depth = depth_hypotheses_[marker];
  if (!depth.follows(intersection.direction, at_)) depth.begin(committed_at_, intersection.direction, depth_m);
  const double sigma_m2 = 2.0 * intersection.reach_m * std::max(kMinReachSigma_m, residual_m_);
  depth.update(at_, intersection.direction, intersection.half_chord_m2, sigma_m2);
}

// The uppermost bone of a chain of two or more that this ray alone observes; -1 if there is none.
int SkeletonTracker::find_bearing_only_limb(std::span<const kinematics::Observation> seen,
                                            const kinematics::Observation& ray) const {
  const auto& set = pose_.marker_set();
  const auto parent_of = [&](int bone) { return set.skeleton.bones[static_cast<std::size_t>(bone)].parent; };
  const auto observability_of = [&](int bone) { return bones_[static_cast<std::size_t>(bone)].observability; };
  const int own = set.markers[static_cast<std::size_t>(ray.marker)].bone;
  if (observability_of(own) == Observability::Full || parent_of(own) < 0) return -1;
  int lower = own;
  while (observability_of(parent_of(lower)) != Observability::Full) {
    lower = parent_of(lower);
    if (parent_of(lower) < 0) return -1;
  }
  if (lower == own) return -1;
  for (const kinematics::Observation& other : seen) {
    if (other.marker == ray.marker) continue;
    const MarkerOnBone& marker = set.markers[static_cast<std::size_t>(other.marker)];
    for (int bone = kinematics::sits_in_joint(marker) ? parent_of(marker.bone) : marker.bone; bone >= 0;
         bone = parent_of(bone)) {
      if (bone == lower) return -1;
    }
  }
  return lower;
}

// Whether the parent has no own observation either, or no marker of the bone lies away from its joint.
bool SkeletonTracker::is_weakly_observed(std::size_t bone) const {
  const MarkerSet& set = pose_.marker_set();
  const int above = set.skeleton.bones[bone].parent;
  return (above >= 0 && bones_[static_cast<std::size_t>(above)].observability != Observability::Full) ||
         std::none_of(set.markers.begin(), set.markers.end(), [&](const MarkerOnBone& one) {
           return one.bone == static_cast<int>(bone) && !kinematics::sits_in_joint(one);
         });
}

// Sets all descendants of the bone to the rest pose.
void SkeletonTracker::straighten_below(std::size_t lower) {
  const auto& bones = pose_.marker_set().skeleton.bones;
  std::copy(pose_.locals().begin(), pose_.locals().end(), straight_pose_.begin());
  for (std::size_t b = 0; b < bones.size(); ++b) {
    const bool is_descendant = bones[b].parent >= 0 && is_below_[static_cast<std::size_t>(bones[b].parent)] != 0;
    is_below_[b] = b == lower || is_descendant ? 1 : 0;
    if (is_descendant) straight_pose_[b].rotation.setIdentity();
  }
  pose_.set_locals(straight_pose_);
}

// Rotates the bone in its joint until the marker has the direction of `place`.
void SkeletonTracker::swing_marker_to(std::size_t lower, std::size_t marker, const Eigen::Vector3d& place) {
  const std::span<const Pose> world = pose_.world();
  const Eigen::Vector3d& joint = world[lower].position;
  const auto above = static_cast<std::size_t>(pose_.marker_set().skeleton.bones[lower].parent);
  const Eigen::Quaterniond swing = kinematics::rotation_between(pose_.marker_at(marker) - joint, place - joint);
  std::copy(pose_.locals().begin(), pose_.locals().end(), trial_pose_.begin());
  trial_pose_[lower].rotation = (world[above].rotation.conjugate() * swing * world[lower].rotation).normalized();
  pose_.set_locals(trial_pose_);
}

// Cost of the current pose after a local fit. The joints of the limb have full rest pose and range priors, and the
// covariance that they have drifted to; all others keep the motion prior (decision 0009).
double SkeletonTracker::evaluate_limb_cost(std::size_t lower, std::span<const kinematics::Observation> seen,
                                           int iterations) {
  const auto above = static_cast<std::size_t>(pose_.marker_set().skeleton.bones[lower].parent);
  const Eigen::Matrix3d identity = Eigen::Matrix3d::Identity();
  std::copy(predicted_.begin(), predicted_.end(), limb_prior_pose_.begin());
  for (std::size_t b = 0; b < is_below_.size(); ++b) {
    const bool is_released = is_below_[b] != 0 || b == above;
    limb_prior_information_[b] =
        is_released ? joint_drift_.prior_information(b, kRecentSigma_rad, 0.0) : prior_information_[b];
    limb_rest_confidence_[b] = is_below_[b] != 0 ? 1.0 : rest_confidence_[b];
    limb_limit_confidence_[b] = is_below_[b] != 0 ? 1.0 : limit_confidence_[b];
    if (is_below_[b] == 0 || !mean_rotation_.known(b)) continue;
    // Fuses the two predictions of the joint by their information: the motion model and the running mean.
    const Eigen::Matrix3d reversion_information = identity / (kMeanReversionSigma_rad * kMeanReversionSigma_rad);
    limb_prior_information_[b] += reversion_information;
    const Eigen::Vector3d rotation_to_mean =
        limb_prior_information_[b].inverse() *
        (reversion_information * mean_rotation_.rotation_to_mean(b, limb_prior_pose_[b].rotation));
    limb_prior_pose_[b].rotation =
        (kinematics::from_rotation_vector(rotation_to_mean) * limb_prior_pose_[b].rotation).normalized();
  }
  kinematics::PosePrior prior = make_prior(seen.size());
  prior.prior_information = limb_prior_information_;
  prior.prior_pose = limb_prior_pose_;
  prior.rest_confidence = limb_rest_confidence_;
  prior.limit_confidence = limb_limit_confidence_;
  return pose_.solve(seen, prior, {.max_iterations = iterations, .small_step = kConvergedStep}).cost;
}

}  // namespace mocap::pose
