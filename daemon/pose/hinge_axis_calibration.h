#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

#include "model/skeleton.h"

namespace mocap::pose {

/// Which way the joints bend that bend one way only. Nobody holds the arms in T-pose turned about themselves as the
/// file has them, so a body's elbow bends about another line than the file's: one that leans, about the limb, by an
/// angle that stays. It is learnt while markers tell the joint.
///
/// Allocates in the constructor only.
class HingeAxisCalibration {
 public:
  explicit HingeAxisCalibration(const Skeleton& skeleton);

  /// Nothing is known of anybody.
  void reset();
  /// A joint was turned so for `step_s`, of which markers told `observed_fraction` (1 along an axis that they told
  /// alone, in the parent's frame). True when its lean is another now.
  bool update(std::size_t bone, const Eigen::Quaterniond& local, const Eigen::Matrix3d& observed_fraction,
              double step_s);

  double axis_offset_rad(std::size_t bone) const;
  /// Takes a rotation vector of the joint to one that bends as the file's.
  Eigen::Matrix3d nominal_from_calibrated(std::size_t bone) const;

 private:
  struct Hinge {
    int hinge_axis = -1;    // the axis that the file's bends about; -1: it is no hinge
    int minor_axis = 0;     // the one that it hardly turns about
    double sign = 1.0;      // of a bend
    double bend_sum = 0.0;  // how far it was bent, squared, summed over time: rad^2 s, in the file's way
    double side_sum = 0.0;  // likewise across
    double axis_offset_rad = 0.0;
  };

  std::vector<Hinge> hinges_;  // by bone
};

}  // namespace mocap::pose
