#pragma once

#include <Eigen/Core>
#include <vector>

#include "scene/actor.h"

namespace mocap::scene {

/// Distance between two line segments. Source: Ericson, Real-Time Collision Detection (2005), section 5.1.9.
double segment_distance_m(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                          const Eigen::Vector3d& d);

/// The volume of a body: a capsule from each joint to each child joint, and a sphere for the head. The radii are those
/// of an adult, by the names of human18's bones, and 4 cm for any other name.
class Flesh {
 public:
  explicit Flesh(const MarkerSet& marker_set);

  /// Whether the body hides a marker of its own set from a camera at `eye_m`. A limb does not hide markers of its bone,
  /// of the parent or of the children: these markers are on its skin. A marker inside a limb is visible from the side
  /// of the limb on which the marker is. False if the state has no bones.
  bool hides(const ActorState& state, std::size_t marker, const Eigen::Vector3d& eye_m) const;

  /// Whether the body hides a point that is not one of its markers.
  bool hides(const ActorState& state, const Eigen::Vector3d& light_m, const Eigen::Vector3d& eye_m) const;

 private:
  struct Limb {
    int bone;
    int child;  ///< -1: the sphere of the head
    double radius_m;
  };

  bool is_between(const Limb& limb, const ActorState& state, const Eigen::Vector3d& light_m,
                  const Eigen::Vector3d& eye_m) const;

  std::vector<int> parents_;
  std::vector<int> bone_of_marker_;
  std::vector<Limb> limbs_;
};

}  // namespace mocap::scene
