#include "geometry/plausible_rig.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace mocap::geometry {
namespace {

constexpr double kDegreesPerRad = 180.0 / std::numbers::pi;
// A room. Chosen by hand: 100 m is twice the largest capture volumes; a rig of 0.1 m or more in millimetres exceeds it.
constexpr double kMaxDistance_m = 100.0;
// From the world's origin to a camera: a rig surveyed in the coordinates of a building, not of a country.
constexpr double kMaxFromOrigin_m = 1000.0;
// Two lenses cannot be nearer than the width of their mounts, about 2 cm.
constexpr double kMinDistance_m = 0.005;
// Lenses for motion capture have 20 to 120 degrees, telephoto lenses about 6, the widest rectilinear lenses 150.
constexpr double kMinOpening_deg = 5.0;
constexpr double kMaxOpening_deg = 170.0;
constexpr double kMaxFisheyeOpening_deg = 220.0;  // the widest fisheye lenses on the market
// A region of interest moves the principal point, rarely beyond half an image outside.
constexpr double kMaxOutside = 0.5;
constexpr double kRounding_rad = 1e-3;  // of rotations by pi

bool has_pose(const CameraModel& camera) {
  const CameraFromWorld& pose = camera.camera_from_world;
  return pose.translation != Eigen::Vector3d::Zero() || pose.rotation != Eigen::Matrix3d::Identity();
}

// Opening angle of a lens along an image side, without its distortion.
double opening_deg(LensKind kind, double side_px, double focal_px) {
  const double half = 0.5 * side_px / focal_px;
  return 2.0 * kDegreesPerRad * (kind == LensKind::Fisheye ? half : std::atan(half));
}

std::string focal_remedy(double focal_px, double side_px) {
  if (focal_px < 0.2 * side_px) {
    return "the focal length looks like millimetres: divide it by the pixel pitch in mm (8 mm / 0.0048 mm = 1667 px)";
  }
  return "the focal length is too long for this image size: is it that of another resolution?";
}

std::optional<std::string> lens_fault(const CameraModel& camera) {
  const Lens& lens = camera.lens;
  const double max_deg = lens.kind == LensKind::Fisheye ? kMaxFisheyeOpening_deg : kMaxOpening_deg;
  const double side_px = std::max(camera.width_px, camera.height_px);
  const double focal_px = camera.width_px >= camera.height_px ? lens.fx_px : lens.fy_px;
  const double opening = opening_deg(lens.kind, side_px, focal_px);
  if (opening < kMinOpening_deg || opening > max_deg) {
    return fmt::format("focal length of {:.6g} px gives an opening angle of {:.1f} degrees, expected {} to {}; {}",
                       focal_px, opening, kMinOpening_deg, max_deg, focal_remedy(focal_px, side_px));
  }
  const auto is_outside = [](double at_px, double side) {
    return at_px < -kMaxOutside * side || at_px > (1.0 + kMaxOutside) * side;
  };
  if (is_outside(lens.cx_px, camera.width_px) || is_outside(lens.cy_px, camera.height_px)) {
    return fmt::format(
        "principal point is [{:.6g}, {:.6g}] px, expected x {:.0f} to {:.0f} and y {:.0f} to {:.0f} for an image of "
        "{} x {} px; is it that of another resolution?",
        lens.cx_px, lens.cy_px, -kMaxOutside * camera.width_px, (1.0 + kMaxOutside) * camera.width_px,
        -kMaxOutside * camera.height_px, (1.0 + kMaxOutside) * camera.height_px, camera.width_px, camera.height_px);
  }
  return std::nullopt;
}

// Advice which divisor converts the translation to m, so that the distance becomes that of a usual room.
const char* unit_remedy(double distance_m) {
  if (distance_m > kMaxDistance_m * 10.0) return "translation looks like millimetres: divide by 1000 (m are expected)";
  return "translation looks like centimetres or millimetres: divide by 100 or 1000 (m are expected)";
}

std::optional<std::string> position_fault(const Rig& rig, std::size_t camera) {
  const Eigen::Vector3d at = rig[camera].centre().v;
  if (!at.allFinite()) return std::nullopt;
  double nearest_m = std::numeric_limits<double>::infinity();
  std::size_t neighbour = camera;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    if (c == camera || !has_pose(rig[c])) continue;
    const double distance_m = (rig[c].centre().v - at).norm();
    if (distance_m >= nearest_m) continue;
    nearest_m = distance_m;
    neighbour = c;
  }
  if (neighbour != camera && nearest_m > kMaxDistance_m) {
    return fmt::format("the camera is {:.6g} m from the nearest other one ('{}'), expected at most {} m; {}", nearest_m,
                       rig[neighbour].name, kMaxDistance_m, unit_remedy(nearest_m));
  }
  if (at.norm() > kMaxFromOrigin_m) {
    return fmt::format("the camera is {:.6g} m from the origin, expected at most {} m; {}", at.norm(), kMaxFromOrigin_m,
                       unit_remedy(at.norm()));
  }
  if (neighbour < camera && nearest_m < kMinDistance_m) {
    return fmt::format(
        "the camera is {:.2g} mm from '{}', expected at least {} mm; give each camera its own pose, or divide by less "
        "if the unit was converted",
        1e3 * nearest_m, rig[neighbour].name, 1e3 * kMinDistance_m);
  }
  return std::nullopt;
}

bool has_lens(const CameraModel& camera) {
  return camera.width_px > 0 && camera.height_px > 0 && camera.lens.fx_px > 0.0 && camera.lens.fy_px > 0.0;
}

}  // namespace

std::vector<ImplausibleValue> implausible_values(const Rig& rig) {
  std::vector<ImplausibleValue> values;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    if (!has_lens(rig[c])) continue;
    if (auto fault = lens_fault(rig[c])) values.push_back({c, RigPart::Matrix, *std::move(fault)});
    if (!has_pose(rig[c])) continue;
    if (auto fault = position_fault(rig, c)) values.push_back({c, RigPart::Translation, *std::move(fault)});
  }
  return values;
}

std::optional<std::string> rotation_vector_fault(const Eigen::Vector3d& rotation_rad) {
  const double angle = rotation_rad.norm();
  if (!(angle > std::numbers::pi + kRounding_rad)) return std::nullopt;
  const std::string is = fmt::format("rotation [{:.6g}, {:.6g}, {:.6g}] has an angle of {:.6g} rad, expected 0 to pi; ",
                                     rotation_rad.x(), rotation_rad.y(), rotation_rad.z(), angle);
  if (angle > 2.0 * std::numbers::pi) return is + "it looks like degrees: multiply by pi / 180";
  // Adding zero turns -0 into 0.
  const Eigen::Vector3d same = (1.0 - 2.0 * std::numbers::pi / angle) * rotation_rad + Eigen::Vector3d::Zero();
  return is + fmt::format("the same rotation is [{:.9g}, {:.9g}, {:.9g}]", same.x(), same.y(), same.z());
}

}  // namespace mocap::geometry
