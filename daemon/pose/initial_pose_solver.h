#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "geometry/rigid_fit.h"
#include "kinematics/bone_shapes.h"
#include "kinematics/observation.h"
#include "model/skeleton.h"
#include "pose/bone_pose_hypothesis.h"

namespace mocap::pose {

/// Lays a body on named markers, bone by bone from the one that most of them tell: a first pose for a fit, whatever
/// the body does. Allocates in the constructor only.
class InitialPoseSolver {
 public:
  explicit InitialPoseSolver(const MarkerSet& set);

  /// `set` is the one of the constructor but for its offsets. The poses go into `locals`, as PoseFit has them. False
  /// when no bone has three markers to begin with.
  bool solve(const MarkerSet& set, std::span<const kinematics::Observation> seen, std::span<Pose> locals);

 private:
  struct Next {
    std::size_t bone = 0, from = 0;
  };

  bool begin(std::size_t root);
  void attach(const MarkerSet& set, const Next& next);
  void gather(std::size_t bone);

  kinematics::BoneShapes shapes_;
  std::vector<std::vector<Next>> plans_;              // by root
  std::vector<const kinematics::Observation*> seen_;  // by marker
  std::vector<BonePoseHypothesis> bones_;
  std::vector<geometry::PointPair> pairs_;
};

}  // namespace mocap::pose
