// The part of SkeletonTracker that lays a limb on the other of the two places where a camera's ray meets its reach.

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "pose/skeleton_tracker.h"

#include "kinematics/rotation.h"

namespace mocap::pose {
namespace {

// In half squared sigmas: what the other place must explain better.
constexpr double kDepthCostMargin = 2.0;
constexpr double kConvergedStep = 5e-4;
// What was told just now may be so far from where its motion led to, before it is laid elsewhere.
constexpr double kRecentSigma_rad = 0.3;
constexpr double kInJoint_m = 1e-3;
// A limb's reach is hardly known better, m; and places of a ray that lie so far on either side of its middle are wholly
// different ones.
constexpr double kMinReachSigma_m = 5e-5;
constexpr double kDistinctBranch_m = 0.1;

// Such a marker shows its joint's place, and nothing of its own bone's turn.
bool sits_in_joint(const MarkerOnBone& marker) { return marker.offset_m.norm() < kInJoint_m; }

}  // namespace

// Where a ray meets the sphere about a joint: two places, as far before and behind the middle.
struct SkeletonTracker::RaySphereIntersection {
  Eigen::Vector3d middle;
  Eigen::Vector3d direction;
  double reach_m = 0.0;
  double half_chord_m2 = 0.0;  // below 0 where the ray passes outside

  // Outside, both places are that of the ray next to the sphere.
  double half_chord_m() const { return std::sqrt(std::max(0.0, half_chord_m2)); }
};

// `marker` is on the sphere.
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

// A ray passes through what a limb reaches in two places; small steps do not lead from one to the other, and where both
// are near each other motion may lead to the wrong one. What the limb did there tells, and joints that are soon turned
// as they hardly ever are.
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

// Lays a limb on the likelier of the two places of its ray. False, and the pose as before, where it is there already.
bool SkeletonTracker::reinitialise_limb(std::size_t lower, const kinematics::Observation& ray,
                                        std::span<const kinematics::Observation> seen, int iterations) {
  const auto marker = static_cast<std::size_t>(ray.marker);
  std::copy(pose_.locals().begin(), pose_.locals().end(), fallback_pose_.begin());
  const Eigen::Vector3d place = pose_.marker_at(marker);
  straighten_below(lower);
  const RaySphereIntersection intersection =
      intersect_reach_sphere(ray, pose_.world()[lower].position, pose_.marker_at(marker));
  const double depth_m = (place - intersection.middle).dot(intersection.direction);
  const bool exact = sits_in_joint(pose_.marker_set().markers[marker]);
  if (exact) update_depth_hypotheses(marker, intersection, depth_m);
  const auto way_cost = [&](double at_m) {
    return exact ? depth_hypotheses_[marker].cost(at_m < 0.0 ? DepthGaussianSum::Near : DepthGaussianSum::Far) : 0.0;
  };
  pose_.set_locals(fallback_pose_);
  // Where both places are near each other little is lost by going over.
  const double margin =
      exact ? kDepthCostMargin * std::min(1.0, intersection.half_chord_m() / kDistinctBranch_m) : kDepthCostMargin;
  double min_cost = evaluate_limb_cost(lower, seen, iterations) + way_cost(depth_m) - margin;
  bool elsewhere = false;
  for (const double side : {-1.0, 1.0}) {
    pose_.set_locals(straight_pose_);
    swing_marker_to(lower, marker, intersection.middle + side * intersection.half_chord_m() * intersection.direction);
    const double cost = evaluate_limb_cost(lower, seen, iterations) + way_cost(side);
    if (!(cost < min_cost)) continue;
    min_cost = cost;
    elsewhere = true;
    std::copy(pose_.locals().begin(), pose_.locals().end(), fallback_pose_.begin());
  }
  pose_.set_locals(fallback_pose_);
  return elsewhere;
}

// What the limb did before tells on which side it is, where its end is seen itself and its reach so known.
void SkeletonTracker::update_depth_hypotheses(std::size_t marker, const RaySphereIntersection& intersection,
                                              double depth_m) {
  DepthGaussianSum& depth = depth_hypotheses_[marker];
  if (!depth.follows(intersection.direction, at_)) depth.begin(committed_at_, intersection.direction, depth_m);
  const double sigma_m2 = 2.0 * intersection.reach_m * std::max(kMinReachSigma_m, residual_m_);
  depth.update(at_, intersection.direction, intersection.half_chord_m2, sigma_m2);
}

// The uppermost bone that this ray alone tells of, of two or more in a row; -1 where there are none.
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
    for (int bone = sits_in_joint(marker) ? parent_of(marker.bone) : marker.bone; bone >= 0; bone = parent_of(bone)) {
      if (bone == lower) return -1;
    }
  }
  return lower;
}

// Whether the bone above is hidden, too, or the bone's end alone is seen.
bool SkeletonTracker::is_weakly_observed(std::size_t bone) const {
  const MarkerSet& set = pose_.marker_set();
  const int above = set.skeleton.bones[bone].parent;
  return (above >= 0 && bones_[static_cast<std::size_t>(above)].observability != Observability::Full) ||
         std::none_of(set.markers.begin(), set.markers.end(), [&](const MarkerOnBone& one) {
           return one.bone == static_cast<int>(bone) && !sits_in_joint(one);
         });
}

// What hangs on the bone is as at rest.
void SkeletonTracker::straighten_below(std::size_t lower) {
  const auto& bones = pose_.marker_set().skeleton.bones;
  std::copy(pose_.locals().begin(), pose_.locals().end(), straight_pose_.begin());
  for (std::size_t b = 0; b < bones.size(); ++b) {
    const bool hangs_on = bones[b].parent >= 0 && is_below_[static_cast<std::size_t>(bones[b].parent)] != 0;
    is_below_[b] = b == lower || hangs_on ? 1 : 0;
    if (hangs_on) straight_pose_[b].rotation.setIdentity();
  }
  pose_.set_locals(straight_pose_);
}

// The bone turns in its joint until the marker is where it should be.
void SkeletonTracker::swing_marker_to(std::size_t lower, std::size_t marker, const Eigen::Vector3d& place) {
  const std::span<const Pose> world = pose_.world();
  const Eigen::Vector3d& joint = world[lower].position;
  const auto above = static_cast<std::size_t>(pose_.marker_set().skeleton.bones[lower].parent);
  const Eigen::Quaterniond swung = kinematics::rotation_between(pose_.marker_at(marker) - joint, place - joint);
  std::copy(pose_.locals().begin(), pose_.locals().end(), trial_pose_.begin());
  trial_pose_[lower].rotation = (world[above].rotation.conjugate() * swung * world[lower].rotation).normalized();
  pose_.set_locals(trial_pose_);
}

// What the pose at hand costs, or the best near it, with all that is usual of the limb believed, and what it may have
// turned since it was told.
double SkeletonTracker::evaluate_limb_cost(std::size_t lower, std::span<const kinematics::Observation> seen,
                                           int iterations) {
  const auto above = static_cast<std::size_t>(pose_.marker_set().skeleton.bones[lower].parent);
  const Eigen::Matrix3d level = Eigen::Matrix3d::Identity();
  std::copy(predicted_.begin(), predicted_.end(), limb_prior_pose_.begin());
  for (std::size_t b = 0; b < is_below_.size(); ++b) {
    const bool loose = is_below_[b] != 0 || b == above;
    limb_prior_information_[b] =
        loose ? joint_drift_.prior_information(b, kRecentSigma_rad, 0.0) : prior_information_[b];
    limb_rest_confidence_[b] = is_below_[b] != 0 ? 1.0 : rest_confidence_[b];
    limb_limit_confidence_[b] = is_below_[b] != 0 ? 1.0 : limit_confidence_[b];
    if (is_below_[b] == 0 || !mean_rotation_.known(b)) continue;
    // From both at once: where it goes on to, and where it usually is.
    const Eigen::Matrix3d reversion_information = level / (kMeanReversionSigma_rad * kMeanReversionSigma_rad);
    limb_prior_information_[b] += reversion_information;
    const Eigen::Vector3d between =
        limb_prior_information_[b].inverse() *
        (reversion_information * mean_rotation_.rotation_to_mean(b, limb_prior_pose_[b].rotation));
    limb_prior_pose_[b].rotation =
        (kinematics::from_rotation_vector(between) * limb_prior_pose_[b].rotation).normalized();
  }
  kinematics::PosePrior prior = make_prior(seen.size());
  prior.prior_information = limb_prior_information_;
  prior.prior_pose = limb_prior_pose_;
  prior.rest_confidence = limb_rest_confidence_;
  prior.limit_confidence = limb_limit_confidence_;
  return pose_.solve(seen, prior, {.max_iterations = iterations, .small_step = kConvergedStep}).cost;
}

}  // namespace mocap::pose
