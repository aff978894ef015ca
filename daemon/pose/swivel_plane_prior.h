#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

#include "kinematics/joint_prior.h"
#include "model/skeleton.h"

namespace mocap::pose {

/// In which plane each body's elbows and knees bend, and how far they stray from it: learnt while markers tell the
/// joint, for the time when one camera's ray is all that tells of it. How the bone is turned about itself is free.
///
/// Allocates in the constructor only.
class BendingPlanes {
 public:
  explicit BendingPlanes(const Skeleton& skeleton);

  /// Nothing is known of anybody.
  void reset();
  /// A joint was turned so for `step_s`, of which markers told `share` (1 along an axis that they told alone, in the
  /// parent's frame).
  void learn(std::size_t bone, const Eigen::Quaterniond& local, const Eigen::Matrix3d& share, double step_s);

  /// In the parent's frame. Weightless where not known.
  const kinematics::BendingPlane& plane(std::size_t bone) const { return hinges_[bone].plane; }

 private:
  struct Hinge {
    int along = -1;  // the axis that the bone lies on at rest; -1: it is no hinge
    int bends = 0;   // the axis that the file's turns about
    int across = 0;  // the one that it hardly turns about
    double told_s = 0.0;
    Eigen::Matrix2d swung = Eigen::Matrix2d::Zero();  // of the bone's tip on `bends` and `across`: rad^2 s
    double since_s = 0.0;                             // the plane was told
    kinematics::BendingPlane plane;
  };

  std::vector<Hinge> hinges_;  // by bone
};

}  // namespace mocap::pose
