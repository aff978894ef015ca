#include "pose/hinge_axis_calibration.h"

#include <algorithm>
#include <cmath>

#include "kinematics/hinge_range.h"
#include "kinematics/rotation.h"

namespace mocap::pose {
namespace {

// Bound on the angle between the nominal and the subject's axis. Chosen by hand; not yet measured.
constexpr double kMaxAxisOffset_rad = 0.8;
// Weight of the nominal axis: an observed bend of kNominalBend_rad that lasts kNominalWeight_s. Chosen by hand; not yet
// measured.
constexpr double kNominalWeight_s = 0.1;
constexpr double kNominalBend_rad = 0.5;
// Time constant of exponential forgetting, so that observations with wrong labels fade. Chosen by hand; not yet
// measured.
constexpr double kHingeForgetting_s = 4.0;
constexpr double kMinReportedChange_rad = 0.002;

}  // namespace

HingeAxisCalibration::HingeAxisCalibration(const Skeleton& skeleton) : hinges_(skeleton.bones.size()) {
  for (std::size_t b = 1; b < skeleton.bones.size(); ++b) {
    const auto& limits = skeleton.bones[b].rotation_limits;
    if (!limits[0] || !limits[1] || !limits[2]) continue;
    Hinge& hinge = hinges_[b];
    for (int axis = 0; axis < 3; ++axis) {
      const kinematics::AxisReach reach = kinematics::reach_of(*limits[static_cast<std::size_t>(axis)]);
      if (!kinematics::bends_one_way(reach)) continue;
      hinge.hinge_axis = axis;
      hinge.sign = reach.positive_rad > reach.negative_rad ? 1.0 : -1.0;
    }
    if (hinge.hinge_axis < 0) continue;
    int narrow_axis = -1;
    for (int axis = 0; axis < 3; ++axis) {
      const AngleRange& range = *limits[static_cast<std::size_t>(axis)];
      if (axis != hinge.hinge_axis && std::max(range.max_rad, -range.min_rad) < kinematics::kMaxMinorRange_rad)
        narrow_axis = axis;
    }
    if (narrow_axis < 0) hinge.hinge_axis = -1;
    hinge.minor_axis = std::max(0, narrow_axis);
  }
}

void HingeAxisCalibration::reset() {
  for (Hinge& hinge : hinges_) hinge.bend_sum = hinge.side_sum = hinge.axis_offset_rad = 0.0;
}

bool HingeAxisCalibration::update(std::size_t bone, const Eigen::Quaterniond& local,
                                  const Eigen::Matrix3d& observed_fraction, double step_s) {
  Hinge& hinge = hinges_[bone];
  if (hinge.hinge_axis < 0 || !(step_s > 0.0)) return false;
  if (!(observed_fraction(hinge.hinge_axis, hinge.hinge_axis) > kinematics::kMinObservedFraction &&
        observed_fraction(hinge.minor_axis, hinge.minor_axis) > kinematics::kMinObservedFraction))
    return false;
  const Eigen::Vector3d rotation_rad = kinematics::rotation_vector(local);
  const double bend = hinge.sign * rotation_rad[hinge.hinge_axis], side = rotation_rad[hinge.minor_axis];
  const double angle_rad = std::hypot(bend, side);
  const double decay = std::exp(-step_s / kHingeForgetting_s);
  hinge.bend_sum = decay * hinge.bend_sum + step_s * angle_rad * bend;
  hinge.side_sum = decay * hinge.side_sum + step_s * angle_rad * side;
  const double nominal_sum = kNominalWeight_s * kNominalBend_rad * kNominalBend_rad;
  const double offset_rad = std::clamp(std::atan2(hinge.side_sum, std::max(0.0, hinge.bend_sum) + nominal_sum),
                                       -kMaxAxisOffset_rad, kMaxAxisOffset_rad);
  if (!(std::abs(offset_rad - hinge.axis_offset_rad) > kMinReportedChange_rad)) return false;
  hinge.axis_offset_rad = offset_rad;
  return true;
}

double HingeAxisCalibration::axis_offset_rad(std::size_t bone) const { return hinges_[bone].axis_offset_rad; }

Eigen::Matrix3d HingeAxisCalibration::nominal_from_calibrated(std::size_t bone) const {
  const Hinge& hinge = hinges_[bone];
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  if (hinge.hinge_axis < 0) return rotation;
  const double c = std::cos(hinge.axis_offset_rad), s = hinge.sign * std::sin(hinge.axis_offset_rad);
  rotation(hinge.hinge_axis, hinge.hinge_axis) = rotation(hinge.minor_axis, hinge.minor_axis) = c;
  rotation(hinge.hinge_axis, hinge.minor_axis) = s;
  rotation(hinge.minor_axis, hinge.hinge_axis) = -s;
  return rotation;
}

}  // namespace mocap::pose
