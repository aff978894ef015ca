#include "calibration/rig/compare_rigs.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "calibration/robust_statistics.h"
#include "geometry/lens.h"
#include "geometry/rigid_fit.h"

namespace mocap::calibration {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// A rotation counts as the displacement that it gives a point at this distance. Chosen by hand.
constexpr double kLever_m = 1.0;
constexpr int kIterations = 30;
// Lower bound of the robust scale: the rounding of rig files.
constexpr double kUnmoved_m = 1e-6;
// Centres whose second principal extent is a smaller fraction of the first are collinear. Chosen by hand.
constexpr double kCollinearity = 1e-3;
// The cameras of a rig that has no poses are all at the origin.
constexpr double kMinExtent_m = 1e-6;

struct CameraPair {
  const CameraModel* before;
  const CameraModel* after;
};

double angle_of(const Matrix3d& rotation) { return std::abs(Eigen::AngleAxisd(rotation).angle()); }

Vector3d mean_centre(const std::vector<CameraPair>& pairs, bool after) {
  Vector3d sum = Vector3d::Zero();
  for (const CameraPair& pair : pairs) sum += (after ? pair.after : pair.before)->centre().v;
  return sum / static_cast<double>(pairs.size());
}

double extent_of(const std::vector<CameraPair>& pairs, bool after) {
  const Vector3d middle = mean_centre(pairs, after);
  double sum = 0.0;
  for (const CameraPair& pair : pairs) sum += ((after ? pair.after : pair.before)->centre().v - middle).squaredNorm();
  return std::sqrt(sum);
}

bool are_centres_collinear(const std::vector<CameraPair>& pairs) {
  const Vector3d middle = mean_centre(pairs, false);
  Matrix3d scatter = Matrix3d::Zero();
  for (const CameraPair& pair : pairs) {
    const Vector3d arm = pair.before->centre().v - middle;
    scatter += arm * arm.transpose();
  }
  // Ratio of the second eigenvalue to the first, from the invariants of the matrix.
  const double trace = scatter.trace();
  const double minors = 0.5 * (trace * trace - (scatter * scatter).trace());
  return minors < kCollinearity * kCollinearity * trace * trace;
}

// Fits old_from_new to the camera centres and, if `axes` is set, to the ends of the camera axes: collinear centres do
// not determine the rotation.
Pose fit_alignment(const std::vector<CameraPair>& pairs, const std::vector<double>& weights, bool axes) {
  std::vector<geometry::PointPair> points;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto& [before, after] = pairs[i];
    const Vector3d from = after->centre().v;
    const Vector3d to = before->centre().v;
    points.push_back({from, to, weights[i]});
    for (int axis = 0; axis < 3 && axes; ++axis) {
      points.push_back({from + kLever_m * after->camera_from_world.rotation.row(axis).transpose(),
                        to + kLever_m * before->camera_from_world.rotation.row(axis).transpose(), weights[i]});
    }
  }
  const auto fit = geometry::fit_rigid(points);
  return fit ? fit->to_from : Pose{};
}

// Position and rotation of a camera against the other rig, combined as a length.
double deviation_of(const CameraPair& pair, const Pose& old_from_new) {
  const double position = (old_from_new * pair.after->centre().v - pair.before->centre().v).norm();
  const Matrix3d rotation = old_from_new.rotation.toRotationMatrix();
  const double angle =
      angle_of(pair.before->camera_from_world.rotation * rotation * pair.after->camera_from_world.rotation.transpose());
  return std::hypot(position, kLever_m * angle);
}

Pose align_robustly(const std::vector<CameraPair>& pairs) {
  std::vector<double> weights(pairs.size(), 1.0);
  Pose pose = fit_alignment(pairs, weights, true);
  for (int round = 0; round < kIterations; ++round) {
    std::vector<double> deviations;
    for (const CameraPair& pair : pairs) deviations.push_back(deviation_of(pair, pose));
    const double scale = std::max(kUnmoved_m, median(deviations));
    for (std::size_t i = 0; i < pairs.size(); ++i)
      weights[i] = 1.0 / (1.0 + std::pow(deviations[i] / (2.0 * scale), 4));
    pose = fit_alignment(pairs, weights, true);
  }
  return pose;
}

// A grid of points in the old world, about the point that is nearest to all optical axes.
std::vector<Vector3d> volume_points(const std::vector<CameraPair>& pairs) {
  Matrix3d normal = Matrix3d::Zero();
  Vector3d rhs = Vector3d::Zero();
  double extent = 0.0;
  const Vector3d middle = mean_centre(pairs, false);
  for (const CameraPair& pair : pairs) {
    const Vector3d optical_axis = pair.before->camera_from_world.rotation.row(2).transpose();
    const Matrix3d projection = Matrix3d::Identity() - optical_axis * optical_axis.transpose();
    normal += projection;
    rhs += projection * pair.before->centre().v;
    extent += (pair.before->centre().v - middle).norm() / static_cast<double>(pairs.size());
  }
  normal.diagonal().array() += 1e-6;
  rhs += 1e-6 * middle;
  const Vector3d volume_centre = normal.inverse() * rhs;
  std::vector<Vector3d> points;
  for (const double x : {-0.3, 0.0, 0.3}) {
    for (const double y : {-0.3, 0.0, 0.3}) {
      for (const double z : {-0.3, 0.0, 0.3}) points.emplace_back(volume_centre + extent * Vector3d(x, y, z));
    }
  }
  return points;
}

std::optional<double> image_change_px(const CameraPair& pair, const Pose& old_from_new,
                                      const std::vector<Vector3d>& points) {
  const Pose new_from_old = old_from_new.inverse();
  double sum = 0.0;
  int count = 0;
  for (const Vector3d& point : points) {
    const auto before = geometry::project(*pair.before, {point});
    const auto after = geometry::project(*pair.after, {new_from_old * point});
    if (!before || !after || !geometry::in_image(*pair.before, *before)) continue;
    sum += (after->v - before->v).squaredNorm();
    ++count;
  }
  return count > 0 ? std::optional(std::sqrt(sum / count)) : std::nullopt;
}

CameraChange change_of(const CameraPair& pair, const Pose& old_from_new) {
  const auto& [before, after] = pair;
  CameraChange change;
  change.name = after->name;
  const Matrix3d& rotation_before = before->camera_from_world.rotation;
  const Matrix3d& rotation_after = after->camera_from_world.rotation;
  change.position_m = (old_from_new * after->centre().v - before->centre().v).norm();
  change.rotation_rad =
      angle_of(rotation_before * old_from_new.rotation.toRotationMatrix() * rotation_after.transpose());
  change.raw_position_m = (after->centre().v - before->centre().v).norm();
  change.raw_rotation_rad = angle_of(rotation_before * rotation_after.transpose());
  const double x = after->lens.fx_px / before->lens.fx_px - 1.0;
  const double y = after->lens.fy_px / before->lens.fy_px - 1.0;
  change.focal_change = std::abs(x) > std::abs(y) ? x : y;
  return change;
}

std::vector<std::string> names_missing(const Rig& from, const Rig& in) {
  std::vector<std::string> names;
  for (const CameraModel& camera : from) {
    if (std::ranges::find(in, camera.name, &CameraModel::name) == in.end()) names.push_back(camera.name);
  }
  return names;
}

}  // namespace

Result<RigChange> compare_rigs(const Rig& old_rig, const Rig& new_rig, RigAlignment alignment) {
  std::vector<CameraPair> pairs;
  for (const CameraModel& after : new_rig) {
    const auto before = std::ranges::find(old_rig, after.name, &CameraModel::name);
    if (before != old_rig.end()) pairs.push_back({&*before, &after});
  }
  if (pairs.size() < 2) {
    return Error{ErrorCode::InvalidArgument, fmt::format("{} camera{} in both rigs by name, expected two at least",
                                                         pairs.size(), pairs.size() == 1 ? " is" : "s are")};
  }
  for (const bool after : {false, true}) {
    if (extent_of(pairs, after) > kMinExtent_m) continue;
    return Error{
        ErrorCode::InvalidArgument,
        fmt::format("all cameras of the {} rig are at one place: it has lenses only, expected poses; calibrate "
                    "it with mocap-calibrate wand",
                    after ? "new" : "old")};
  }
  RigChange change;
  change.only_old = names_missing(old_rig, new_rig);
  change.only_new = names_missing(new_rig, old_rig);
  const bool axes = pairs.size() < 3 || are_centres_collinear(pairs);
  change.old_from_new = alignment == RigAlignment::RobustToMoved
                            ? align_robustly(pairs)
                            : fit_alignment(pairs, std::vector<double>(pairs.size(), 1.0), axes);
  const std::vector<Vector3d> points = volume_points(pairs);
  double positions = 0.0;
  double rotations = 0.0;
  for (const CameraPair& pair : pairs) {
    change.cameras.push_back(change_of(pair, change.old_from_new));
    CameraChange& camera = change.cameras.back();
    camera.image_px = image_change_px(pair, change.old_from_new, points);
    positions += camera.position_m * camera.position_m;
    rotations += camera.rotation_rad * camera.rotation_rad;
  }
  const auto count = static_cast<double>(pairs.size());
  change.position_m = std::sqrt(positions / count);
  change.rotation_rad = std::sqrt(rotations / count);
  change.scale = extent_of(pairs, true) / extent_of(pairs, false);
  change.world_moved_m = change.old_from_new.position.norm();
  change.world_rotated_rad = angle_of(change.old_from_new.rotation.toRotationMatrix());
  return change;
}

}  // namespace mocap::calibration
