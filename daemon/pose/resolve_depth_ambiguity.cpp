// The part of BodyFollower that lays a limb on the other of the two places where a camera's ray meets its reach.

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "pose/skeleton_tracker.h"

#include "kinematics/rotation.h"

namespace mocap::pose {
namespace {

// In half squared sigmas: what the other place must explain better.
constexpr double kClearMargin = 2.0;
constexpr double kSmallStep = 5e-4;
// What was told just now may be so far from where its motion led to, before it is laid elsewhere.
constexpr double kJustTold_rad = 0.3;
constexpr double kInJoint_m = 1e-3;
// A limb's reach is hardly known better, m; and places of a ray that lie so far on either side of its middle are wholly
// different ones.
constexpr double kReach_m = 5e-5;
constexpr double kFarApart_m = 0.1;

// Such a marker shows its joint's place, and nothing of its own bone's turn.
bool sits_in_joint(const MarkerOnBone& marker) { return marker.offset_m.norm() < kInJoint_m; }

}  // namespace

// Where a ray meets the sphere about a joint: two places, as far before and behind the middle.
struct BodyFollower::Crossing {
  Eigen::Vector3d middle;
  Eigen::Vector3d direction;
  double reach_m = 0.0;
  double half2_m2 = 0.0;  // below 0 where the ray passes outside

  // Outside, both places are that of the ray next to the sphere.
  double half_m() const { return std::sqrt(std::max(0.0, half2_m2)); }
};

// `marker` is on the sphere.
BodyFollower::Crossing BodyFollower::crossing_of(const kinematics::Observation& ray, const Eigen::Vector3d& joint,
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
kinematics::PoseFitResult BodyFollower::cross_over(std::span<const kinematics::Observation> seen, const kinematics::PosePrior& prior, const kinematics::PoseFitEnd& end,
                                       kinematics::PoseFitResult first) {
  for (const kinematics::Observation& one : seen) {
    if (!one.ray || !kinematics::is_usable(one)) continue;
    const int limb = limb_on_ray(seen, one);
    if (limb < 0 || !lay_elsewhere(static_cast<std::size_t>(limb), one, seen, end.max_iterations)) continue;
    first = pose_.solve(seen, prior, end);
    for (std::size_t b = 0; b < below_.size(); ++b) bent_back_[b] |= below_[b];
  }
  return first;
}

// Lays a limb on the likelier of the two places of its ray. False, and the pose as before, where it is there already.
bool BodyFollower::lay_elsewhere(std::size_t lower, const kinematics::Observation& ray, std::span<const kinematics::Observation> seen,
                                 int iterations) {
  const auto marker = static_cast<std::size_t>(ray.marker);
  std::copy(pose_.locals().begin(), pose_.locals().end(), tried_.begin());
  const Eigen::Vector3d place = pose_.marker_at(marker);
  unbend_below(lower);
  const Crossing crossing = crossing_of(ray, pose_.world()[lower].position, pose_.marker_at(marker));
  const double depth_m = (place - crossing.middle).dot(crossing.direction);
  const bool exact = sits_in_joint(pose_.marker_set().markers[marker]);
  if (exact) weigh_depth(marker, crossing, depth_m);
  const auto way_cost = [&](double at_m) {
    return exact ? depths_[marker].cost(at_m < 0.0 ? RayDepth::Before : RayDepth::Behind) : 0.0;
  };
  pose_.set_locals(tried_);
  // Where both places are near each other little is lost by going over.
  const double margin = exact ? kClearMargin * std::min(1.0, crossing.half_m() / kFarApart_m) : kClearMargin;
  double least = unheld_cost(lower, seen, iterations) + way_cost(depth_m) - margin;
  bool elsewhere = false;
  for (const double side : {-1.0, 1.0}) {
    pose_.set_locals(unbent_);
    swing_to(lower, marker, crossing.middle + side * crossing.half_m() * crossing.direction);
    const double cost = unheld_cost(lower, seen, iterations) + way_cost(side);
    if (!(cost < least)) continue;
    least = cost;
    elsewhere = true;
    std::copy(pose_.locals().begin(), pose_.locals().end(), tried_.begin());
  }
  pose_.set_locals(tried_);
  return elsewhere;
}

// What the limb did before tells on which side it is, where its end is seen itself and its reach so known.
void BodyFollower::weigh_depth(std::size_t marker, const Crossing& crossing, double depth_m) {
  RayDepth& depth = depths_[marker];
  if (!depth.follows(crossing.direction, at_)) depth.begin(learnt_at_, crossing.direction, depth_m);
  const double sigma_m2 = 2.0 * crossing.reach_m * std::max(kReach_m, residual_m_);
  depth.weigh(at_, crossing.direction, crossing.half2_m2, sigma_m2);
}

// The uppermost bone that this ray alone tells of, of two or more in a row; -1 where there are none.
int BodyFollower::limb_on_ray(std::span<const kinematics::Observation> seen, const kinematics::Observation& ray) const {
  const auto& set = pose_.marker_set();
  const auto parent_of = [&](int bone) { return set.skeleton.bones[static_cast<std::size_t>(bone)].parent; };
  const auto told = [&](int bone) { return bones_[static_cast<std::size_t>(bone)].told; };
  const int own = set.markers[static_cast<std::size_t>(ray.marker)].bone;
  if (told(own) == Told::Direct || parent_of(own) < 0) return -1;
  int lower = own;
  while (told(parent_of(lower)) != Told::Direct) {
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
bool BodyFollower::hangs_free(std::size_t bone) const {
  const MarkerSet& set = pose_.marker_set();
  const int above = set.skeleton.bones[bone].parent;
  return (above >= 0 && bones_[static_cast<std::size_t>(above)].told != Told::Direct) ||
         std::none_of(set.markers.begin(), set.markers.end(), [&](const MarkerOnBone& one) {
           return one.bone == static_cast<int>(bone) && !sits_in_joint(one);
         });
}

// What hangs on the bone is as at rest.
void BodyFollower::unbend_below(std::size_t lower) {
  const auto& bones = pose_.marker_set().skeleton.bones;
  std::copy(pose_.locals().begin(), pose_.locals().end(), unbent_.begin());
  for (std::size_t b = 0; b < bones.size(); ++b) {
    const bool hangs_on = bones[b].parent >= 0 && below_[static_cast<std::size_t>(bones[b].parent)] != 0;
    below_[b] = b == lower || hangs_on ? 1 : 0;
    if (hangs_on) unbent_[b].rotation.setIdentity();
  }
  pose_.set_locals(unbent_);
}

// The bone turns in its joint until the marker is where it should be.
void BodyFollower::swing_to(std::size_t lower, std::size_t marker, const Eigen::Vector3d& place) {
  const std::span<const Pose> world = pose_.world();
  const Eigen::Vector3d& joint = world[lower].position;
  const auto above = static_cast<std::size_t>(pose_.marker_set().skeleton.bones[lower].parent);
  const Eigen::Quaterniond swung = kinematics::turn_between(pose_.marker_at(marker) - joint, place - joint);
  std::copy(pose_.locals().begin(), pose_.locals().end(), turned_.begin());
  turned_[lower].rotation = (world[above].rotation.conjugate() * swung * world[lower].rotation).normalized();
  pose_.set_locals(turned_);
}

// What the pose at hand costs, or the best near it, with all that is usual of the limb believed, and what it may have
// turned since it was told.
double BodyFollower::unheld_cost(std::size_t lower, std::span<const kinematics::Observation> seen, int iterations) {
  const auto above = static_cast<std::size_t>(pose_.marker_set().skeleton.bones[lower].parent);
  const Eigen::Matrix3d level = Eigen::Matrix3d::Identity();
  std::copy(predicted_.begin(), predicted_.end(), held_.begin());
  for (std::size_t b = 0; b < below_.size(); ++b) {
    const bool loose = below_[b] != 0 || b == above;
    unheld_weight_[b] = loose ? hidden_.hold_weight(b, kJustTold_rad, 0.0) : hold_weight_[b];
    unheld_rest_[b] = below_[b] != 0 ? 1.0 : rest_believed_[b];
    unheld_limit_[b] = below_[b] != 0 ? 1.0 : limit_believed_[b];
    if (below_[b] == 0 || !usual_.known(b)) continue;
    // From both at once: where it goes on to, and where it usually is.
    const Eigen::Matrix3d usual = level / (kOffUsual_rad * kOffUsual_rad);
    unheld_weight_[b] += usual;
    const Eigen::Vector3d between = unheld_weight_[b].inverse() * (usual * usual_.turn_from(b, held_[b].rotation));
    held_[b].rotation = (kinematics::turn_by(between) * held_[b].rotation).normalized();
  }
  kinematics::PosePrior prior = prior_of(seen.size());
  prior.hold_weight = unheld_weight_;
  prior.hold_from = held_;
  prior.rest_believed = unheld_rest_;
  prior.limit_believed = unheld_limit_;
  return pose_.solve(seen, prior, {.max_iterations = iterations, .small_step = kSmallStep}).cost;
}

}  // namespace mocap::pose
