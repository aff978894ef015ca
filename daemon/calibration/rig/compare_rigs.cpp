#include "calibration/rig/compare_rigs.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "calibration/median.h"
#include "geometry/lens.h"
#include "geometry/rigid_fit.h"

namespace mocap::calibration {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// A camera's turn counts as much as a shift of a point so far before it.
constexpr double kArm_m = 1.0;
constexpr int kRounds = 30;
// Under this, cameras count as if they had not moved at all: files are rounded.
constexpr double kStill_m = 1e-6;
// A mean distance from the cameras' middle line under this share of their spread is a line.
constexpr double kOnALine = 1e-3;

struct Pair {
  const CameraModel* before;
  const CameraModel* after;
};

double angle_of(const Matrix3d& turn) { return std::abs(Eigen::AngleAxisd(turn).angle()); }

Vector3d middle_of(const std::vector<Pair>& pairs, bool after) {
  Vector3d sum = Vector3d::Zero();
  for (const Pair& pair : pairs) sum += (after ? pair.after : pair.before)->centre().v;
  return sum / static_cast<double>(pairs.size());
}

double spread_of(const std::vector<Pair>& pairs, bool after) {
  const Vector3d middle = middle_of(pairs, after);
  double sum = 0.0;
  for (const Pair& pair : pairs) sum += ((after ? pair.after : pair.before)->centre().v - middle).squaredNorm();
  return std::sqrt(sum);
}

bool on_a_line(const std::vector<Pair>& pairs) {
  const Vector3d middle = middle_of(pairs, false);
  Matrix3d spread = Matrix3d::Zero();
  for (const Pair& pair : pairs) {
    const Vector3d arm = pair.before->centre().v - middle;
    spread += arm * arm.transpose();
  }
  // The second spread over the first: the area of the widest triangle tells it without an eigenvalue.
  const double trace = spread.trace();
  const double minors = 0.5 * (trace * trace - (spread * spread).trace());
  return minors < kOnALine * kOnALine * trace * trace;
}

// Old from new by the centres and, where these do not tell or shall not alone, by the axes.
Pose align(const std::vector<Pair>& pairs, const std::vector<double>& weights, bool axes) {
  std::vector<geometry::PointPair> points;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const auto& [before, after] = pairs[i];
    const Vector3d from = after->centre().v;
    const Vector3d to = before->centre().v;
    points.push_back({from, to, weights[i]});
    for (int axis = 0; axis < 3 && axes; ++axis) {
      points.push_back({from + kArm_m * after->camera_from_world.rotation.row(axis).transpose(),
                        to + kArm_m * before->camera_from_world.rotation.row(axis).transpose(), weights[i]});
    }
  }
  const auto fit = geometry::fit_rigid(points);
  return fit ? fit->to_from : Pose{};
}

// How far a camera is off, its turn counted at the arm.
double off_by(const Pair& pair, const Pose& old_from_new) {
  const double place = (old_from_new * pair.after->centre().v - pair.before->centre().v).norm();
  const Matrix3d turn = old_from_new.rotation.toRotationMatrix();
  const double angle =
      angle_of(pair.before->camera_from_world.rotation * turn * pair.after->camera_from_world.rotation.transpose());
  return std::hypot(place, kArm_m * angle);
}

Pose align_on_those_that_stayed(const std::vector<Pair>& pairs) {
  std::vector<double> weights(pairs.size(), 1.0);
  Pose pose = align(pairs, weights, true);
  for (int round = 0; round < kRounds; ++round) {
    std::vector<double> off;
    for (const Pair& pair : pairs) off.push_back(off_by(pair, pose));
    const double scale = std::max(kStill_m, median(off));
    for (std::size_t i = 0; i < pairs.size(); ++i) weights[i] = 1.0 / (1.0 + std::pow(off[i] / (2.0 * scale), 4));
    pose = align(pairs, weights, true);
  }
  return pose;
}

// Points of the volume before the cameras, in the old world: about their middle, where their axes meet best.
std::vector<Vector3d> volume_points(const std::vector<Pair>& pairs) {
  Matrix3d normal = Matrix3d::Zero();
  Vector3d rhs = Vector3d::Zero();
  double reach = 0.0;
  const Vector3d middle = middle_of(pairs, false);
  for (const Pair& pair : pairs) {
    const Vector3d along = pair.before->camera_from_world.rotation.row(2).transpose();
    const Matrix3d across = Matrix3d::Identity() - along * along.transpose();
    normal += across;
    rhs += across * pair.before->centre().v;
    reach += (pair.before->centre().v - middle).norm() / static_cast<double>(pairs.size());
  }
  normal.diagonal().array() += 1e-6;
  rhs += 1e-6 * middle;
  const Vector3d aim = normal.inverse() * rhs;
  std::vector<Vector3d> points;
  for (const double x : {-0.3, 0.0, 0.3}) {
    for (const double y : {-0.3, 0.0, 0.3}) {
      for (const double z : {-0.3, 0.0, 0.3}) points.emplace_back(aim + reach * Vector3d(x, y, z));
    }
  }
  return points;
}

double image_change_px(const Pair& pair, const Pose& old_from_new, const std::vector<Vector3d>& points) {
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
  return count > 0 ? std::sqrt(sum / count) : 0.0;
}

CameraChange change_of(const Pair& pair, const Pose& old_from_new) {
  const auto& [before, after] = pair;
  CameraChange change;
  change.name = after->name;
  const Matrix3d& was = before->camera_from_world.rotation;
  const Matrix3d& is = after->camera_from_world.rotation;
  change.position_m = (old_from_new * after->centre().v - before->centre().v).norm();
  change.rotation_rad = angle_of(was * old_from_new.rotation.toRotationMatrix() * is.transpose());
  change.raw_position_m = (after->centre().v - before->centre().v).norm();
  change.raw_rotation_rad = angle_of(was * is.transpose());
  const double x = after->lens.fx_px / before->lens.fx_px - 1.0;
  const double y = after->lens.fy_px / before->lens.fy_px - 1.0;
  change.focal_share = std::abs(x) > std::abs(y) ? x : y;
  return change;
}

std::vector<std::string> missing(const Rig& from, const Rig& in) {
  std::vector<std::string> names;
  for (const CameraModel& camera : from) {
    if (std::ranges::find(in, camera.name, &CameraModel::name) == in.end()) names.push_back(camera.name);
  }
  return names;
}

}  // namespace

Result<RigChange> compare_rigs(const Rig& old_rig, const Rig& new_rig, RigAlignment alignment) {
  std::vector<Pair> pairs;
  for (const CameraModel& after : new_rig) {
    const auto before = std::ranges::find(old_rig, after.name, &CameraModel::name);
    if (before != old_rig.end()) pairs.push_back({&*before, &after});
  }
  if (pairs.size() < 2) {
    return Error{ErrorCode::InvalidArgument, fmt::format("{} camera{} in both rigs by name, expected two at least",
                                                         pairs.size(), pairs.size() == 1 ? " is" : "s are")};
  }
  RigChange change;
  change.only_old = missing(old_rig, new_rig);
  change.only_new = missing(new_rig, old_rig);
  const bool axes = pairs.size() < 3 || on_a_line(pairs);
  change.old_from_new = alignment == RigAlignment::MostStayed
                            ? align_on_those_that_stayed(pairs)
                            : align(pairs, std::vector<double>(pairs.size(), 1.0), axes);
  const std::vector<Vector3d> points = volume_points(pairs);
  double places = 0.0;
  double turns = 0.0;
  for (const Pair& pair : pairs) {
    change.cameras.push_back(change_of(pair, change.old_from_new));
    CameraChange& camera = change.cameras.back();
    camera.image_px = image_change_px(pair, change.old_from_new, points);
    places += camera.position_m * camera.position_m;
    turns += camera.rotation_rad * camera.rotation_rad;
  }
  const auto count = static_cast<double>(pairs.size());
  change.position_m = std::sqrt(places / count);
  change.rotation_rad = std::sqrt(turns / count);
  change.scale = spread_of(pairs, true) / spread_of(pairs, false);
  change.frame_moved_m = change.old_from_new.position.norm();
  change.frame_turned_rad = angle_of(change.old_from_new.rotation.toRotationMatrix());
  return change;
}

}  // namespace mocap::calibration
