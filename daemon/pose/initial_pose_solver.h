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

/// Computes an initial pose from labelled markers, bone by bone, from the bone with most detected markers outwards. It
/// needs no earlier pose. Allocates in the constructor only.
class InitialPoseSolver {
 public:
  explicit InitialPoseSolver(const MarkerSet& set);

  /// `set` equals the set of the constructor except for its offsets. Writes local poses as PoseFit has them. False if
  /// no bone has three detected markers off a line.
  bool solve(const MarkerSet& set, std::span<const kinematics::Observation> seen, std::span<Pose> locals);

 private:
  struct Attachment {
    std::size_t bone = 0, from = 0;
  };

  bool begin(std::size_t root);
  void attach(const MarkerSet& set, const Attachment& next);
  void gather(std::size_t bone);

  kinematics::BoneShapes shapes_;
  std::vector<std::vector<Attachment>> attachments_;  // by root, in breadth-first order
  std::vector<const kinematics::Observation*> seen_;  // by marker
  std::vector<BonePoseHypothesis> bones_;
  std::vector<geometry::PointPair> pairs_;
};

}  // namespace mocap::pose
