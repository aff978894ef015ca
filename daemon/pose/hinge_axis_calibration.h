#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

#include "base/archive.h"
#include "model/skeleton.h"

namespace mocap::pose {

/// Learns the hinge axes of a subject: the rotation axes of joints that bend one way (elbows, knees). The skeleton file
/// gives a nominal axis. No subject holds the arms in T-pose with the file's rotation about the arm, so the subject's
/// axis differs from the nominal axis by a constant angle about the limb. The angle is learned while markers observe
/// the joint.
///
/// Allocates in the constructor only.
class HingeAxisCalibration {
 public:
  explicit HingeAxisCalibration(const Skeleton& skeleton);

  /// Forgets all angles (a new subject).
  void reset();
  /// Adds an observation: the joint had the rotation `local` for `step_s`; `observed_fraction` is the part that markers
  /// observed (parent's frame; 1 along an axis that markers alone determine). True if the angle changed by more than
  /// 0.002 rad.
  bool update(std::size_t bone, const Eigen::Quaterniond& local, const Eigen::Matrix3d& observed_fraction,
              double step_s);

  double axis_offset_rad(std::size_t bone) const;
  /// Takes a rotation vector about the subject's axes to one about the nominal axes.
  Eigen::Matrix3d nominal_from_calibrated(std::size_t bone) const;

  /// Writes the belief, or takes it over from an object that was built with the same settings (see Archive).
  void archive(Archive& members) { members(hinges_); }

 private:
  struct Hinge {
    int hinge_axis = -1;    // the nominal hinge axis; -1: the joint is no hinge
    int minor_axis = 0;     // the other axis across the limb, with a range below kMaxMinorRange_rad
    double sign = 1.0;      // of the bending direction
    double bend_sum = 0.0;  // sum of bend angle times total angle over time, rad^2 s, about the nominal axis
    double side_sum = 0.0;  // the same about the minor axis
    double axis_offset_rad = 0.0;

    // The axes are those of the skeleton.
    void archive(Archive& members) { members(bend_sum, side_sum, axis_offset_rad); }
  };

  std::vector<Hinge> hinges_;  // by bone
};

}  // namespace mocap::pose
