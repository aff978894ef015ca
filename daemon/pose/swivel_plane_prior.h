#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

#include "base/archive.h"
#include "kinematics/joint_prior.h"
#include "model/skeleton.h"

namespace mocap::pose {

/// Learns the plane in which each elbow and knee of a subject bends, and the deviation from it, while markers observe
/// the joint. The plane is a prior for the third rotation (swivel angle) of a limb that only one bearing or markers
/// further down observe. The twist of the bone is left free.
///
/// Allocates in the constructor only.
class SwivelPlanePrior {
 public:
  explicit SwivelPlanePrior(const Skeleton& skeleton);

  /// Forgets all planes (a new subject).
  void reset();
  /// Adds an observation: the joint had the rotation `local` for `step_s`; `observed_fraction` is the part that markers
  /// observed (parent's frame; 1 along an axis that markers alone determine).
  void update(std::size_t bone, const Eigen::Quaterniond& local, const Eigen::Matrix3d& observed_fraction,
              double step_s);

  /// In the parent's frame; with weight 0 if unknown.
  const kinematics::SwivelPlane& plane(std::size_t bone) const { return hinges_[bone].plane; }

  /// Writes the belief, or takes it over from an object that was built with the same settings (see Archive).
  void archive(Archive& members) { members(hinges_); }

 private:
  struct Hinge {
    int bone_axis = -1;  // the axis along the bone in rest pose; -1: the joint is no hinge
    int hinge_axis = 0;  // the axis of the bend
    int minor_axis = 0;  // the other axis across the bone
    double observed_s = 0.0;
    Eigen::Matrix2d tip_scatter =
        // second moments of the bone's tip direction on `hinge_axis` and `minor_axis`, rad^2 s
        Eigen::Matrix2d::Zero();
    double since_update_s = 0.0;  // time since the plane was last computed
    kinematics::SwivelPlane plane;

    // The axes are those of the skeleton.
    void archive(Archive& members) { members(observed_s, tip_scatter, since_update_s, plane); }
  };

  std::vector<Hinge> hinges_;  // by bone
};

}  // namespace mocap::pose
