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

// An arm that is longer or shorter than told by more is another's.
constexpr double kArmSlack_m = 0.015;
constexpr double kMostOff_m = 0.01;
// Points closer to one line than this, as a share of their length, tell no plane.
constexpr double kFlatness = 0.05;
// What of a walk's points counts as low, and how near to the plane they are that a foot rests on.
constexpr double kStep_m = 0.01;
constexpr int kRounds = 30;

struct Plane {
  Vector3d on = Vector3d::Zero();
  Vector3d up = Vector3d::UnitZ();
  double rms_m = 0.0;
  double flatness = 0.0;  ///< second spread over the first

  double height(const Vector3d& point) const { return up.dot(point - on); }
};

Vector3d middle_of_cameras(const Rig& rig) {
  Vector3d sum = Vector3d::Zero();
  for (const CameraModel& camera : rig) sum += camera.centre().v;
  return sum / static_cast<double>(rig.size());
}

Plane fit_plane(std::span<const Vector3d> points, const Rig& rig) {
  Plane plane;
  plane.on.setZero();
  for (const Vector3d& point : points) plane.on += point / static_cast<double>(points.size());
  Matrix3d spread = Matrix3d::Zero();
  for (const Vector3d& point : points) spread += (point - plane.on) * (point - plane.on).transpose();
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(spread);
  plane.up = eigen.eigenvectors().col(0);
  if (plane.up.dot(middle_of_cameras(rig) - plane.on) < 0.0) plane.up = -plane.up;
  plane.rms_m = std::sqrt(std::max(0.0, eigen.eigenvalues()[0]) / static_cast<double>(points.size()));
  plane.flatness = std::sqrt(std::max(0.0, eigen.eigenvalues()[1]) / std::max(1e-30, eigen.eigenvalues()[2]));
  return plane;
}

Pose world_on(const Plane& plane, double height_m, const Rig& rig) {
  const Vector3d& z = plane.up;
  Vector3d x = Vector3d::UnitX() - z.x() * z;
  if (x.norm() < 0.3) x = Vector3d::UnitY() - z.y() * z;
  x.normalize();
  Matrix3d rig_from_world;
  rig_from_world << x, z.cross(x), z;
  const Vector3d middle = middle_of_cameras(rig);
  const Vector3d origin = middle - (plane.height(middle) + height_m) * z;
  Pose pose;
  pose.rotation = Eigen::Quaterniond(Matrix3d(rig_from_world.transpose())).normalized();
  pose.position = -(pose.rotation * origin);
  return pose;
}

struct Found {
  std::array<std::size_t, 3> points;  // corner, end of the long arm, of the short one
  geometry::RigidFit fit;
};

std::optional<Found> try_frame(std::span<const Vector3d> points, std::array<std::size_t, 3> at,
                               const FloorFrame& frame) {
  const double longer = (points[at[1]] - points[at[0]]).norm();
  const double shorter = (points[at[2]] - points[at[0]]).norm();
  if (std::abs(longer - frame.long_m) > kArmSlack_m || std::abs(shorter - frame.short_m) > kArmSlack_m)
    return std::nullopt;
  const std::array<geometry::PointPair, 3> pairs{{{points[at[0]], {0.0, 0.0, frame.height_m}},
                                                  {points[at[1]], {frame.long_m, 0.0, frame.height_m}},
                                                  {points[at[2]], {0.0, frame.short_m, frame.height_m}}}};
  const auto fit = geometry::fit_rigid(pairs);
  if (!fit || fit->rms_m > kMostOff_m) return std::nullopt;
  return Found{at, *fit};
}

}  // namespace

namespace {

// Seen in a mirror, cameras that hang upright hang head down under the floor; over a frame that lies on a ceiling, or
// before one that is held up, they stay upright.
Error under_the_floor(const Pose& world_from_rig, const Rig& rig) {
  Vector3d up = Vector3d::Zero();
  for (const CameraModel& camera : rig) up -= camera.camera_from_world.rotation.row(1).transpose();
  if ((world_from_rig.rotation * up).z() < 0.0) {
    return {ErrorCode::InvalidArgument,
            "the world would be mirrored: the frame's short arm points to the wrong side, so the cameras would hang "
            "head down under the floor; see that no camera mirrors its images, and that the short arm, seen from "
            "above, is 90 degrees counter-clockwise of the long one"};
  }
  return {
      ErrorCode::InvalidArgument,
      "the world would be upside down: the cameras would look up at the floor frame from below; lay it on the floor, "
      "its markers up"};
}

}  // namespace

Result<Floor> floor_by_frame(std::span<const Vector3d> points_m, const FloorFrame& frame, const Rig& rig) {
  std::vector<Found> found;
  const std::size_t n = points_m.size();
  for (std::size_t corner = 0; corner < n; ++corner) {
    for (std::size_t far = 0; far < n; ++far) {
      for (std::size_t near = 0; near < n; ++near) {
        if (corner == far || corner == near || far == near) continue;
        if (const auto one = try_frame(points_m, {corner, far, near}, frame)) found.push_back(*one);
      }
    }
  }
  if (found.empty()) {
    return Error{
        ErrorCode::InvalidArgument,
        fmt::format("no floor frame among {} markers that lie still: expected a corner with arms of {:.0f} and "
                    "{:.0f} mm at a right angle; lay it where two cameras and more see it whole, or say its "
                    "arms with --arms",
                    n, 1e3 * frame.long_m, 1e3 * frame.short_m)};
  }
  const auto best = std::ranges::min_element(found, {}, [](const Found& one) { return one.fit.rms_m; });
  if (std::ranges::any_of(found, [&](const Found& other) { return other.points != best->points; })) {
    return Error{
        ErrorCode::InvalidArgument,
        fmt::format("{} readings of the floor frame among {} markers; take the others off the floor, and use a "
                    "frame with arms of different lengths",
                    found.size(), n)};
  }
  const Pose& world_from_rig = best->fit.to_from;
  if ((world_from_rig * middle_of_cameras(rig)).z() < 0.0) return under_the_floor(world_from_rig, rig);
  return Floor{world_from_rig, best->fit.rms_m};
}

Result<Floor> floor_by_points(std::span<const Vector3d> points_m, double height_m, const Rig& rig) {
  if (points_m.size() < 3) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("{} markers on the floor, expected three at least, well apart", points_m.size())};
  }
  const Plane plane = fit_plane(points_m, rig);
  if (plane.flatness < kFlatness) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("the {} markers on the floor lie on one line; lay one aside of it", points_m.size())};
  }
  return Floor{world_on(plane, height_m, rig), plane.rms_m};
}

Result<Floor> floor_by_walk(std::span<const Vector3d> points_m, double height_m, const Rig& rig) {
  if (points_m.size() < 100) {
    return Error{
        ErrorCode::InvalidArgument,
        fmt::format("{} points of a walk, expected 100 at least; walk through the whole volume", points_m.size())};
  }
  // From a plane through all points down to the lowest ones, keeping those near the plane that nothing goes below.
  Plane plane = fit_plane(points_m, rig);
  std::vector<Vector3d> low(points_m.begin(), points_m.end());
  for (int round = 0; round < kRounds; ++round) {
    std::vector<double> heights;
    for (const Vector3d& point : points_m) heights.push_back(plane.height(point));
    auto sorted = heights;
    // The lowest of a hundred may be a ghost.
    const auto lowest = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 100);
    std::ranges::nth_element(sorted, lowest);
    const double reach = std::max(kStep_m, 0.3 * std::pow(0.8, round));
    low.clear();
    for (std::size_t i = 0; i < points_m.size(); ++i) {
      if (std::abs(heights[i] - *lowest) < reach) low.push_back(points_m[i]);
    }
    if (low.size() < 10) break;
    plane = fit_plane(low, rig);
  }
  if (low.size() < 10 || plane.flatness < kFlatness) {
    return Error{
        ErrorCode::InvalidArgument,
        fmt::format("only {} points of the walk lie on one plane, in a strip; walk in a circle, with markers on "
                    "both feet",
                    low.size())};
  }
  return Floor{world_on(plane, height_m, rig), plane.rms_m};
}

Floor floor_by_guess(std::span<const Vector3d> points_m, const Rig& rig) {
  Plane plane;
  plane.up.setZero();
  for (const CameraModel& camera : rig) plane.up -= camera.camera_from_world.rotation.row(1).transpose();
  if (plane.up.norm() < 1e-3) plane.up = Vector3d::UnitZ();
  plane.up.normalize();
  for (const Vector3d& point : points_m) {
    if (plane.height(point) < 0.0 || plane.on.isZero()) plane.on = point;
  }
  return {world_on(plane, 0.0, rig), 0.0};
}

Rig laid_on(const Floor& floor, const Rig& rig) {
  const Pose rig_from_world = floor.world_from_rig.inverse();
  Rig laid = rig;
  for (CameraModel& camera : laid) {
    const CameraFromWorld before = camera.camera_from_world;
    camera.camera_from_world.rotation = before.rotation * rig_from_world.rotation.toRotationMatrix();
    camera.camera_from_world.translation = before.rotation * rig_from_world.position + before.translation;
  }
  return laid;
}

}  // namespace mocap::calibration
