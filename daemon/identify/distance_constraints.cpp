#include "identify/distance_constraints.h"

#include <cmath>
#include <optional>

#include "base/expects.h"
#include "kinematics/kinematic_tree.h"

namespace mocap::identify {
namespace {

// Position of a marker in the frame of `bone`; nothing if the position depends on the pose.
std::optional<Eigen::Vector3d> fixed_position_in(const MarkerSet& set, std::size_t marker, int bone) {
  const MarkerOnBone& on = set.markers[marker];
  if (on.bone == bone) return on.offset_m;
  const Bone& own = set.skeleton.bones[static_cast<std::size_t>(on.bone)];
  if (own.parent == bone && kinematics::sits_in_joint(on)) return own.rest_offset_m;
  return std::nullopt;
}

// The constraint of two markers: rigid if both are fixed in the frame of the bone of `lower` or of its parent;
// otherwise, if `upper` is fixed in the parent, the bounds from the distances of both to the joint (triangle
// inequality).
std::optional<InterMarkerDistance> distance_between(const MarkerSet& set, std::size_t lower, std::size_t upper) {
  const int bone = set.markers[lower].bone;
  const int parent = set.skeleton.bones[static_cast<std::size_t>(bone)].parent;
  for (const int frame : {bone, parent}) {
    const auto a = fixed_position_in(set, lower, frame);
    const auto b = fixed_position_in(set, upper, frame);
    if (frame >= 0 && a && b)
      return InterMarkerDistance{static_cast<int>(upper), (*a - *b).norm(), (*a - *b).norm(), true};
  }
  const auto above = parent < 0 ? std::nullopt : fixed_position_in(set, upper, parent);
  if (!above) return std::nullopt;
  const double from_joint = set.markers[lower].offset_m.norm();
  const double to_joint = (*above - set.skeleton.bones[static_cast<std::size_t>(bone)].rest_offset_m).norm();
  return InterMarkerDistance{static_cast<int>(upper), std::abs(from_joint - to_joint), from_joint + to_joint, false};
}

// The tighter constraint of both orders: a rigid one, if there is one.
std::optional<InterMarkerDistance> constraint_of(const MarkerSet& set, std::size_t a, std::size_t b) {
  std::optional<InterMarkerDistance> distance = distance_between(set, a, b);
  if (!distance || !distance->rigid) {
    const std::optional<InterMarkerDistance> other = distance_between(set, b, a);
    if (other && (!distance || other->rigid)) distance = other;
  }
  if (distance) distance->other = static_cast<int>(b);
  return distance;
}

}  // namespace

DistanceConstraints::DistanceConstraints(const MarkerSet& set) : distances_(set.markers.size()) {
  for (std::size_t a = 0; a < distances_.size(); ++a) {
    for (std::size_t b = 0; b < distances_.size(); ++b) {
      const std::optional<InterMarkerDistance> distance = a == b ? std::nullopt : constraint_of(set, a, b);
      if (distance) distances_[a].push_back(*distance);
    }
  }
}

void DistanceConstraints::refit(const MarkerSet& set) {
  MOCAP_EXPECTS(set.markers.size() == distances_.size());
  for (std::size_t a = 0; a < distances_.size(); ++a) {
    for (InterMarkerDistance& distance : distances_[a])
      distance = constraint_of(set, a, static_cast<std::size_t>(distance.other)).value_or(distance);
  }
}

}  // namespace mocap::identify
