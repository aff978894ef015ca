#pragma once

#include <Eigen/Core>
#include <vector>

#include "scene/actor.h"

namespace mocap::scene {

/// Distance between two line segments. Source: Ericson, Real-Time Collision Detection (2005), section 5.1.9.
double segment_distance_m(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                          const Eigen::Vector3d& d);

/// The flesh of a skeleton: one capsule from each joint to each joint that hangs from it, and a ball for the head; as
/// thick as those of an adult by the names of human18's bones, 4 cm where a name tells nothing.
class Flesh {
 public:
  explicit Flesh(const MarkerSet& marker_set);

  /// Whether the body stands between an eye and a marker of its set. A limb hides no marker of its own bone, nor of
  /// the bone it hangs from, nor of the bones that hang from it: those sit on its skin. Nor does a limb hide a marker
  /// that lies in it from the side on which it lies. Without bones nothing hides.
  bool hides(const ActorState& state, std::size_t marker, const Eigen::Vector3d& eye_m) const;

  /// Whether the body stands between an eye and somebody else's light.
  bool hides(const ActorState& state, const Eigen::Vector3d& light_m, const Eigen::Vector3d& eye_m) const;

 private:
  struct Limb {
    int bone;
    int child;  ///< -1: the ball of the head
    double radius_m;
  };

  bool is_between(const Limb& limb, const ActorState& state, const Eigen::Vector3d& light_m,
                  const Eigen::Vector3d& eye_m) const;

  std::vector<int> parents_;
  std::vector<int> bone_of_marker_;
  std::vector<Limb> limbs_;
};

}  // namespace mocap::scene
