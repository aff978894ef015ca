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
class SwivelPlanePrior {
 public:
  explicit SwivelPlanePrior(const Skeleton& skeleton);

  /// Nothing is known of anybody.
  void reset();
  /// A joint was turned so for `step_s`, of which markers told `observed_fraction` (1 along an axis that they told
  /// alone, in the parent's frame).
  void update(std::size_t bone, const Eigen::Quaterniond& local, const Eigen::Matrix3d& observed_fraction,
              double step_s);

  /// In the parent's frame. Weightless where not known.
  const kinematics::SwivelPlane& plane(std::size_t bone) const { return hinges_[bone].plane; }

 private:
  struct Hinge {
    int bone_axis = -1;  // the axis that the bone lies on at rest; -1: it is no hinge
    int hinge_axis = 0;  // the axis that the file's turns about
    int minor_axis = 0;  // the one that it hardly turns about
    double observed_s = 0.0;
    Eigen::Matrix2d tip_scatter =
        Eigen::Matrix2d::Zero();  // of the bone's tip on `hinge_axis` and `minor_axis`: rad^2 s
    double since_update_s = 0.0;  // the plane was told
    kinematics::SwivelPlane plane;
  };

  std::vector<Hinge> hinges_;  // by bone
};

}  // namespace mocap::pose
