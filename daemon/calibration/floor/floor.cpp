#include "calibration/floor/floor.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "geometry/rigid_fit.h"

namespace mocap::calibration {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// A floor frame is measured by hand, and the scale of a wand calibration is good to 0.1 %: larger differences are
// another frame. Chosen by hand; not yet measured.
constexpr double kArmTolerance_m = 0.015;
constexpr double kMaxFitResidual_m = 0.01;
// Points whose second principal extent is a smaller fraction of the first lie on a line. Chosen by hand.
constexpr double kMinFlatness = 0.05;
// A larger residual is a marker that is not on the floor. Chosen by hand; not yet measured.
constexpr double kMaxPlaneResidual_m = 0.015;
// Final half-width of the band of points about the floor plane of a walk. Chosen by hand; not yet measured.
constexpr double kBand_m = 0.01;
constexpr double kFirstBand_m = 0.3;
constexpr double kBandShrink = 0.8;  // per iteration
constexpr int kIterations = 30;
constexpr std::size_t kMinWalkPoints = 100;
constexpr std::size_t kMinLowPoints = 10;

struct Plane {
  Vector3d on = Vector3d::Zero();
  Vector3d up = Vector3d::UnitZ();
  double rms_m = 0.0;
  double flatness = 0.0;  // second principal extent over the first

  double height(const Vector3d& point) const { return up.dot(point - on); }
};

Vector3d mean_centre(const Rig& rig) {
  Vector3d sum = Vector3d::Zero();
  for (const CameraModel& camera : rig) sum += camera.centre().v;
  return sum / static_cast<double>(rig.size());
}

// Total least squares; `up` points to the side of the cameras.
Plane fit_plane(std::span<const Vector3d> points, const Rig& rig) {
  Plane plane;
  plane.on.setZero();
  for (const Vector3d& point : points) plane.on += point / static_cast<double>(points.size());
  Matrix3d spread = Matrix3d::Zero();
  for (const Vector3d& point : points) spread += (point - plane.on) * (point - plane.on).transpose();
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(spread);
  plane.up = eigen.eigenvectors().col(0);
  if (plane.up.dot(mean_centre(rig) - plane.on) < 0.0) plane.up = -plane.up;
  plane.rms_m = std::sqrt(std::max(0.0, eigen.eigenvalues()[0]) / static_cast<double>(points.size()));
  plane.flatness = std::sqrt(std::max(0.0, eigen.eigenvalues()[1]) / std::max(1e-30, eigen.eigenvalues()[2]));
  return plane;
}

Pose world_of_plane(const Plane& plane, double height_m, const Rig& rig) {
  const Vector3d& z = plane.up;
  Vector3d x = Vector3d::UnitX() - z.x() * z;
  if (x.norm() < 0.3) x = Vector3d::UnitY() - z.y() * z;
  x.normalize();
  Matrix3d rig_from_world;
  rig_from_world << x, z.cross(x), z;
  const Vector3d middle = mean_centre(rig);
  const Vector3d origin = middle - (plane.height(middle) + height_m) * z;
  Pose pose;
  pose.rotation = Eigen::Quaterniond(Matrix3d(rig_from_world.transpose())).normalized();
  pose.position = -(pose.rotation * origin);
  return pose;
}

struct FrameCandidate {
  std::array<std::size_t, 3> points;  // corner, end of the long arm, end of the short arm
  geometry::RigidFit fit;
};

std::optional<FrameCandidate> fit_frame(std::span<const Vector3d> points, std::array<std::size_t, 3> at,
                                        const FloorFrame& frame) {
  const double long_m = (points[at[1]] - points[at[0]]).norm();
  const double short_m = (points[at[2]] - points[at[0]]).norm();
  if (std::abs(long_m - frame.long_m) > kArmTolerance_m || std::abs(short_m - frame.short_m) > kArmTolerance_m)
    return std::nullopt;
  const std::array<geometry::PointPair, 3> pairs{{{points[at[0]], {0.0, 0.0, frame.height_m}},
                                                  {points[at[1]], {frame.long_m, 0.0, frame.height_m}},
                                                  {points[at[2]], {0.0, frame.short_m, frame.height_m}}}};
  const auto fit = geometry::fit_rigid(pairs);
  if (!fit || fit->rms_m > kMaxFitResidual_m) return std::nullopt;
  return FrameCandidate{at, *fit};
}

// Why the cameras would be below the floor. In a mirrored world, upright cameras are upside down; if the frame is on a
// ceiling or upside down, the cameras stay upright.
Error below_floor_error(const Pose& world_from_rig, const Rig& rig) {
  Vector3d up = Vector3d::Zero();
  for (const CameraModel& camera : rig) up -= camera.camera_from_world.rotation.row(1).transpose();
  if ((world_from_rig.rotation * up).z() < 0.0) {
    return {ErrorCode::InvalidArgument,
            "the world would be mirrored: the short arm of the floor frame points to the wrong side, so the cameras "
            "would be upside down below the floor; check that no camera mirrors its images, and that the short arm, "
            "seen from above, is 90 degrees counter-clockwise of the long arm"};
  }
  return {ErrorCode::InvalidArgument,
          "the world would be upside down: the cameras would be below the floor frame; put the frame on the floor with "
          "its markers up"};
}

/// A marker without which the others fit a plane best.
struct OffPlane {
  Vector3d marker;
  double rms_without_m = 0.0;
};

// Leave-one-out. The farthest marker from the plane through all need not be the wrong one: a wrong marker at the border
// tilts the plane. Nothing for four markers, of which any three fit, or if the others always lie on one line.
std::optional<OffPlane> find_off_plane(std::span<const Vector3d> points_m, const Rig& rig) {
  std::optional<OffPlane> found;
  if (points_m.size() < 5) return found;
  for (std::size_t i = 0; i < points_m.size(); ++i) {
    std::vector<Vector3d> others(points_m.begin(), points_m.end());
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    const Plane plane = fit_plane(others, rig);
    if (plane.flatness < kMinFlatness || (found && plane.rms_m >= found->rms_without_m)) continue;
    found = OffPlane{points_m[i], plane.rms_m};
  }
  return found;
}

Error off_plane_error(std::span<const Vector3d> points_m, const Plane& plane, const Rig& rig) {
  const std::string figures =
      fmt::format("the {} markers on the floor are {:.0f} mm rms off one plane, expected at most {:.0f}",
                  points_m.size(), 1e3 * plane.rms_m, 1e3 * kMaxPlaneResidual_m);
  const std::optional<OffPlane> off = find_off_plane(points_m, rig);
  if (!off) {
    return {ErrorCode::InvalidArgument,
            fmt::format("{}: one of them is not on the floor, and {} markers do not show which one; lay all of them on "
                        "the floor, add another one, or take all lights that are not on the floor away",
                        figures, points_m.size())};
  }
  return {
      ErrorCode::InvalidArgument,
      fmt::format("{}; without the one at ({:.2f}, {:.2f}, {:.2f}) m in the world of the rig, the others are {:.0f} "
                  "mm rms off: lay it on the floor, or take it and all lights that are not on the floor away",
                  figures, off->marker.x(), off->marker.y(), off->marker.z(), 1e3 * off->rms_without_m)};
}

}  // namespace

Result<Floor> floor_from_frame(std::span<const Vector3d> points_m, const FloorFrame& frame, const Rig& rig) {
  std::vector<FrameCandidate> found;
  const std::size_t n = points_m.size();
  for (std::size_t corner = 0; corner < n; ++corner) {
    for (std::size_t far = 0; far < n; ++far) {
      for (std::size_t near = 0; near < n; ++near) {
        if (corner == far || corner == near || far == near) continue;
        if (const auto candidate = fit_frame(points_m, {corner, far, near}, frame)) found.push_back(*candidate);
      }
    }
  }
  if (found.empty()) {
    return Error{
        ErrorCode::InvalidArgument,
        fmt::format("no floor frame among {} stationary markers, expected a corner with arms of {:.0f} and {:.0f} mm "
                    "at a right angle; put the whole frame into the common view of two cameras or more, or set its "
                    "arm lengths with --frame",
                    n, 1e3 * frame.long_m, 1e3 * frame.short_m)};
  }
  const auto best = std::ranges::min_element(found, {}, [](const FrameCandidate& each) { return each.fit.rms_m; });
  if (std::ranges::any_of(found, [&](const FrameCandidate& other) { return other.points != best->points; })) {
    return Error{
        ErrorCode::InvalidArgument,
        fmt::format("{} possible floor frames among {} markers; remove the other markers from the floor, and use a "
                    "frame with arms of different lengths",
                    found.size(), n)};
  }
  const Pose& world_from_rig = best->fit.to_from;
  if ((world_from_rig * mean_centre(rig)).z() < 0.0) return below_floor_error(world_from_rig, rig);
  return Floor{world_from_rig, best->fit.rms_m};
}

Result<Floor> floor_from_points(std::span<const Vector3d> points_m, double height_m, const Rig& rig) {
  if (points_m.size() < 3) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("{} markers on the floor, expected at least three, far apart", points_m.size())};
  }
  const Plane plane = fit_plane(points_m, rig);
  if (plane.flatness < kMinFlatness) {
    return Error{
        ErrorCode::InvalidArgument,
        fmt::format("the {} markers on the floor lie on one line; move one of them off the line", points_m.size())};
  }
  if (plane.rms_m > kMaxPlaneResidual_m) return off_plane_error(points_m, plane, rig);
  return Floor{world_of_plane(plane, height_m, rig), plane.rms_m, points_m.size() > 3};
}

Result<Floor> floor_from_walk(std::span<const Vector3d> points_m, double height_m, const Rig& rig) {
  if (points_m.size() < kMinWalkPoints) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("{} points of a walk, expected at least {}; walk through the whole volume",
                             points_m.size(), kMinWalkPoints)};
  }
  // Starts with a plane through all points. Each iteration fits the plane to the points in a shrinking band about the
  // first percentile of the heights; the percentile ignores ghost markers below the floor.
  Plane plane = fit_plane(points_m, rig);
  std::vector<Vector3d> low(points_m.begin(), points_m.end());
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    std::vector<double> heights;
    for (const Vector3d& point : points_m) heights.push_back(plane.height(point));
    auto sorted = heights;
    const auto lowest = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 100);
    std::ranges::nth_element(sorted, lowest);
    const double band_m = std::max(kBand_m, kFirstBand_m * std::pow(kBandShrink, iteration));
    low.clear();
    for (std::size_t i = 0; i < points_m.size(); ++i) {
      if (std::abs(heights[i] - *lowest) < band_m) low.push_back(points_m[i]);
    }
    if (low.size() < kMinLowPoints) break;
    plane = fit_plane(low, rig);
  }
  if (low.size() < kMinLowPoints || plane.flatness < kMinFlatness) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("only {} points of the walk lie on one plane, or all on one line; walk in a circle, with "
                             "markers on both feet",
                             low.size())};
  }
  return Floor{world_of_plane(plane, height_m, rig), plane.rms_m};
}

Floor guess_floor(std::span<const Vector3d> points_m, const Rig& rig) {
  Plane plane;
  plane.up.setZero();
  for (const CameraModel& camera : rig) plane.up -= camera.camera_from_world.rotation.row(1).transpose();
  if (plane.up.norm() < 1e-3) plane.up = Vector3d::UnitZ();
  plane.up.normalize();
  for (const Vector3d& point : points_m) {
    if (plane.height(point) < 0.0 || plane.on.isZero()) plane.on = point;
  }
  return {world_of_plane(plane, 0.0, rig), 0.0};
}

Rig in_world(const Floor& floor, const Rig& rig) {
  const Pose rig_from_world = floor.world_from_rig.inverse();
  Rig moved = rig;
  for (CameraModel& camera : moved) {
    const CameraFromWorld before = camera.camera_from_world;
    camera.camera_from_world.rotation = before.rotation * rig_from_world.rotation.toRotationMatrix();
    camera.camera_from_world.translation = before.rotation * rig_from_world.position + before.translation;
  }
  return moved;
}

}  // namespace mocap::calibration
