#include "pose/hinge_axis_calibration.h"

#include <algorithm>
#include <cmath>

#include "kinematics/rotation.h"

namespace mocap::pose {
namespace {

// A hinge's range on the wrong side is at most this share of that on the right one; so is that across.
constexpr double kOneWay = 0.15;
constexpr double kAcross_rad = 0.3;
// Nobody's leans by more.
constexpr double kMostLean_rad = 0.8;
// What the file says counts as much as a bend by half a radian that was seen for so long.
constexpr double kFile_s = 0.1;
constexpr double kBend_rad = 0.5;
// What was seen is forgotten with this time constant, so that wrong names are.
constexpr double kForget_s = 4.0;
constexpr double kTold = 0.8;
constexpr double kSmallChange_rad = 0.002;

}  // namespace

HingeLeans::HingeLeans(const Skeleton& skeleton) : hinges_(skeleton.bones.size()) {
  for (std::size_t b = 1; b < skeleton.bones.size(); ++b) {
    const auto& turns = skeleton.bones[b].turns;
    if (!turns[0] || !turns[1] || !turns[2]) continue;
    Hinge& hinge = hinges_[b];
    for (int axis = 0; axis < 3; ++axis) {
      const AngleRange& range = *turns[static_cast<std::size_t>(axis)];
      const double up = std::max(0.0, range.max_rad), down = std::max(0.0, -range.min_rad);
      if (std::min(up, down) > kOneWay * std::max(up, down)) continue;
      hinge.bends = axis;
      hinge.sign = up > down ? 1.0 : -1.0;
    }
    if (hinge.bends < 0) continue;
    int narrow = -1;
    for (int axis = 0; axis < 3; ++axis) {
      const AngleRange& range = *turns[static_cast<std::size_t>(axis)];
      if (axis != hinge.bends && std::max(range.max_rad, -range.min_rad) < kAcross_rad) narrow = axis;
    }
    if (narrow < 0) hinge.bends = -1;
    hinge.across = std::max(0, narrow);
  }
}

void HingeLeans::reset() {
  for (Hinge& hinge : hinges_) hinge.along = hinge.aside = hinge.lean_rad = 0.0;
}

bool HingeLeans::learn(std::size_t bone, const Eigen::Quaterniond& local, const Eigen::Matrix3d& share, double step_s) {
  Hinge& hinge = hinges_[bone];
  if (hinge.bends < 0 || !(step_s > 0.0)) return false;
  if (!(share(hinge.bends, hinge.bends) > kTold && share(hinge.across, hinge.across) > kTold)) return false;
  const Eigen::Vector3d turned = kinematics::rotation_vector(local);
  const double bend = hinge.sign * turned[hinge.bends], aside = turned[hinge.across];
  const double size = std::hypot(bend, aside);
  const double left = std::exp(-step_s / kForget_s);
  hinge.along = left * hinge.along + step_s * size * bend;
  hinge.aside = left * hinge.aside + step_s * size * aside;
  const double file = kFile_s * kBend_rad * kBend_rad;
  const double lean =
      std::clamp(std::atan2(hinge.aside, std::max(0.0, hinge.along) + file), -kMostLean_rad, kMostLean_rad);
  if (!(std::abs(lean - hinge.lean_rad) > kSmallChange_rad)) return false;
  hinge.lean_rad = lean;
  return true;
}

double HingeLeans::lean_rad(std::size_t bone) const { return hinges_[bone].lean_rad; }

Eigen::Matrix3d HingeLeans::as_in_file(std::size_t bone) const {
  const Hinge& hinge = hinges_[bone];
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  if (hinge.bends < 0) return turn;
  const double c = std::cos(hinge.lean_rad), s = hinge.sign * std::sin(hinge.lean_rad);
  turn(hinge.bends, hinge.bends) = turn(hinge.across, hinge.across) = c;
  turn(hinge.bends, hinge.across) = s;
  turn(hinge.across, hinge.bends) = -s;
  return turn;
}

}  // namespace mocap::pose
