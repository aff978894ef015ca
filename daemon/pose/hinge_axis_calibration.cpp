#include "pose/hinge_axis_calibration.h"

#include <algorithm>
#include <cmath>

#include "kinematics/rotation.h"

namespace mocap::pose {
namespace {

// A hinge's range on the wrong side is at most this share of that on the right one; so is that across.
constexpr double kMaxReverseRangeFraction = 0.15;
constexpr double kMaxMinorRange_rad = 0.3;
// Nobody's leans by more.
constexpr double kMaxAxisOffset_rad = 0.8;
// What the file says counts as much as a bend by half a radian that was seen for so long.
constexpr double kNominalWeight_s = 0.1;
constexpr double kNominalBend_rad = 0.5;
// What was seen is forgotten with this time constant, so that wrong names are.
constexpr double kHingeForgetting_s = 4.0;
constexpr double kMinObservedFraction = 0.8;
constexpr double kMinReportedChange_rad = 0.002;

}  // namespace

HingeAxisCalibration::HingeAxisCalibration(const Skeleton& skeleton) : hinges_(skeleton.bones.size()) {
  for (std::size_t b = 1; b < skeleton.bones.size(); ++b) {
    const auto& turns = skeleton.bones[b].turns;
    if (!turns[0] || !turns[1] || !turns[2]) continue;
    Hinge& hinge = hinges_[b];
    for (int axis = 0; axis < 3; ++axis) {
      const AngleRange& range = *turns[static_cast<std::size_t>(axis)];
      const double up = std::max(0.0, range.max_rad), down = std::max(0.0, -range.min_rad);
      if (std::min(up, down) > kMaxReverseRangeFraction * std::max(up, down)) continue;
      hinge.hinge_axis = axis;
      hinge.sign = up > down ? 1.0 : -1.0;
    }
    if (hinge.hinge_axis < 0) continue;
    int narrow_axis = -1;
    for (int axis = 0; axis < 3; ++axis) {
      const AngleRange& range = *turns[static_cast<std::size_t>(axis)];
      if (axis != hinge.hinge_axis && std::max(range.max_rad, -range.min_rad) < kMaxMinorRange_rad) narrow_axis = axis;
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
  if (!(observed_fraction(hinge.hinge_axis, hinge.hinge_axis) > kMinObservedFraction &&
        observed_fraction(hinge.minor_axis, hinge.minor_axis) > kMinObservedFraction))
    return false;
  const Eigen::Vector3d turned = kinematics::rotation_vector(local);
  const double bend = hinge.sign * turned[hinge.hinge_axis], side_sum = turned[hinge.minor_axis];
  const double size = std::hypot(bend, side_sum);
  const double decay = std::exp(-step_s / kHingeForgetting_s);
  hinge.bend_sum = decay * hinge.bend_sum + step_s * size * bend;
  hinge.side_sum = decay * hinge.side_sum + step_s * size * side_sum;
  const double file = kNominalWeight_s * kNominalBend_rad * kNominalBend_rad;
  const double offset_rad = std::clamp(std::atan2(hinge.side_sum, std::max(0.0, hinge.bend_sum) + file),
                                       -kMaxAxisOffset_rad, kMaxAxisOffset_rad);
  if (!(std::abs(offset_rad - hinge.axis_offset_rad) > kMinReportedChange_rad)) return false;
  hinge.axis_offset_rad = offset_rad;
  return true;
}

double HingeAxisCalibration::axis_offset_rad(std::size_t bone) const { return hinges_[bone].axis_offset_rad; }

Eigen::Matrix3d HingeAxisCalibration::nominal_from_calibrated(std::size_t bone) const {
  const Hinge& hinge = hinges_[bone];
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  if (hinge.hinge_axis < 0) return turn;
  const double c = std::cos(hinge.axis_offset_rad), s = hinge.sign * std::sin(hinge.axis_offset_rad);
  turn(hinge.hinge_axis, hinge.hinge_axis) = turn(hinge.minor_axis, hinge.minor_axis) = c;
  turn(hinge.hinge_axis, hinge.minor_axis) = s;
  turn(hinge.minor_axis, hinge.hinge_axis) = -s;
  return turn;
}

}  // namespace mocap::pose
