#include "calibration/diagnosis/fit_camera.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>

#include "geometry/lens.h"

namespace mocap::calibration {
namespace {

using Points = std::vector<std::vector<ConsensusPoint>>;

constexpr double kDegree = std::numbers::pi / 180.0;
// Pairs of points tried. Both points are visible in at least every fifth pair.
constexpr int kTrials = 80;
constexpr double kMinPairAngle_rad = 4.0 * kDegree;
// A camera that was also moved by 5 cm sees a point at 4 m at another angle of 0.7 degrees.
constexpr double kPairTolerance_rad = 0.4 * kDegree;
constexpr double kRayTolerance_rad = 0.8 * kDegree;
constexpr std::size_t kMinPoints = 4;
// Gates of the nearest neighbours: they shrink while the model improves.
constexpr double kGates_px[] = {25.0, 15.0, 10.0, 6.0, 6.0, 4.5, 4.5, 4.5};
constexpr double kRobustScale_px = 2.0;  // of the Cauchy loss
constexpr double kMinShare = 0.05;       // of the points that have a neighbour
// Focal lengths tried, as a ratio: steps of 1 % move a blob at the border of the image by about 6 px.
constexpr double kMaxFocalRatio = 3.0;
constexpr double kFocalStep = 0.01;
constexpr double kFocalGate_px = 8.0;
// Bounds the work: a rig of few cameras has ten thousands of accidental intersections of two rays. A model with six
// parameters needs some dozens of true ones.
constexpr std::size_t kMaxFitPoints = 2000;

Eigen::Vector3d direction_of(const NormalizedPoint& ray) { return ray.v.homogeneous().normalized(); }

// Directions of the confirmed points from a camera (all points, if none is confirmed), at one instant.
std::vector<Eigen::Vector3d> directions_from(const WorldPoint& centre, const std::vector<ConsensusPoint>& points) {
  const bool any_confirmed = std::ranges::any_of(points, &ConsensusPoint::is_confirmed);
  std::vector<Eigen::Vector3d> directions;
  for (const ConsensusPoint& point : points) {
    if (any_confirmed && !point.is_confirmed) continue;
    const Eigen::Vector3d to = point.point.v - centre.v;
    if (to.norm() > 0.1) directions.push_back(to.normalized());
  }
  return directions;
}

std::vector<Eigen::Vector3d> rays_at(const CameraViews& camera, std::size_t instant) {
  std::vector<Eigen::Vector3d> rays;
  for (const BlobView& blob : camera.instants[instant]) rays.push_back(direction_of(blob.ray));
  return rays;
}

// The rotation that maps two directions onto two rays.
Eigen::Matrix3d rotation_between(const Eigen::Vector3d& from_a, const Eigen::Vector3d& from_b,
                                 const Eigen::Vector3d& to_a, const Eigen::Vector3d& to_b) {
  const auto frame = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
    Eigen::Matrix3d axes;
    axes.col(0) = (a + b).normalized();
    axes.col(1) = a.cross(b).normalized();
    axes.col(2) = axes.col(0).cross(axes.col(1));
    return axes;
  };
  return frame(to_a, to_b) * frame(from_a, from_b).transpose();
}

int count_met(const Eigen::Matrix3d& rotation, const std::vector<Eigen::Vector3d>& directions,
              const std::vector<Eigen::Vector3d>& rays) {
  const double limit = std::cos(kRayTolerance_rad);
  int met = 0;
  for (const Eigen::Vector3d& direction : directions) {
    const Eigen::Vector3d ray = rotation * direction;
    met += std::ranges::any_of(rays, [&](const Eigen::Vector3d& other) { return ray.dot(other) > limit; }) ? 1 : 0;
  }
  return met;
}

/// Searches the rotation of a camera.
class RotationSearch {
 public:
  RotationSearch(const CameraViews& camera, const Points& points) {
    for (std::size_t i = 0; i < points.size(); ++i) {
      auto directions = directions_from(camera.model.centre(), points[i]);
      auto rays = rays_at(camera, i);
      if (directions.size() < kMinPoints || rays.size() < kMinPoints) continue;
      directions_.push_back(std::move(directions));
      rays_.push_back(std::move(rays));
    }
  }

  std::optional<Eigen::Matrix3d> best() {
    if (rays_.empty()) return std::nullopt;
    for (int trial = 0; trial < kTrials; ++trial) try_pair(static_cast<std::size_t>(trial) % rays_.size());
    return most_ > 0 ? std::optional(best_) : std::nullopt;
  }

 private:
  void try_pair(std::size_t instant) {
    const auto& directions = directions_[instant];
    const auto& rays = rays_[instant];
    const Eigen::Vector3d& a = directions[random_() % directions.size()];
    const Eigen::Vector3d& b = directions[random_() % directions.size()];
    const double angle = std::acos(std::clamp(a.dot(b), -1.0, 1.0));
    if (angle < kMinPairAngle_rad || angle > std::numbers::pi / 2.0) return;
    const double low = std::cos(angle + kPairTolerance_rad);
    const double high = std::cos(angle - kPairTolerance_rad);
    const int needed = std::max(3, static_cast<int>(directions.size()) / 4);
    for (const Eigen::Vector3d& ray_a : rays) {
      for (const Eigen::Vector3d& ray_b : rays) {
        const double cosine = ray_a.dot(ray_b);
        if (cosine < low || cosine > high) continue;
        const Eigen::Matrix3d rotation = rotation_between(a, b, ray_a, ray_b);
        if (count_met(rotation, directions, rays) >= needed) assess(rotation);
      }
    }
  }

  void assess(const Eigen::Matrix3d& rotation) {
    int met = 0;
    const std::size_t step = std::max<std::size_t>(1, rays_.size() / 10);
    for (std::size_t i = 0; i < rays_.size(); i += step) met += count_met(rotation, directions_[i], rays_[i]);
    if (met <= most_) return;
    most_ = met;
    best_ = rotation;
  }

  std::vector<std::vector<Eigen::Vector3d>> directions_;  // of the points, in the world
  std::vector<std::vector<Eigen::Vector3d>> rays_;        // of the blobs, in the camera's frame
  std::minstd_rand random_{1};
  Eigen::Matrix3d best_ = Eigen::Matrix3d::Identity();
  int most_ = 0;
};

/// A point and its nearest blob.
struct Neighbours {
  WorldPoint point;
  PixelPoint blob;
};

std::vector<Neighbours> neighbours_of(const CameraModel& model, const CameraViews& camera, const Points& points,
                                      double gate_px) {
  std::vector<Neighbours> neighbours;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (const ConsensusPoint& point : points[i]) {
      const auto at = geometry::project(model, point.point);
      if (!at || !geometry::in_image(model, *at)) continue;
      const auto& blobs = camera.instants[i];
      const auto nearest =
          std::ranges::min_element(blobs, {}, [&](const BlobView& blob) { return (blob.at.v - at->v).norm(); });
      if (nearest == blobs.end() || (nearest->at.v - at->v).norm() > gate_px) continue;
      neighbours.push_back({point.point, nearest->at});
    }
  }
  return neighbours;
}

// Every n-th of the points of each kind, so that at most kMaxFitPoints of each remain.
Points thinned(const Points& points) {
  std::array<std::size_t, 2> counts{};  // by is_confirmed
  for (const auto& instant : points) {
    for (const ConsensusPoint& point : instant) ++counts[point.is_confirmed];
  }
  std::array<std::size_t, 2> seen{};
  Points kept(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (const ConsensusPoint& point : points[i]) {
      const std::size_t step = counts[point.is_confirmed] / kMaxFitPoints + 1;
      if (seen[point.is_confirmed]++ % step == 0) kept[i].push_back(point);
    }
  }
  return kept;
}

using Change = std::function<CameraModel(const CameraModel&, const Eigen::VectorXd&)>;

CameraModel with_pose_change(const CameraModel& model, const Eigen::VectorXd& change) {
  CameraModel changed = model;
  const Eigen::Vector3d turn = change.head<3>();
  const double angle = turn.norm();
  const Eigen::Matrix3d rotation = angle > 0.0 ? Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix()
                                               : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
  changed.camera_from_world.rotation = rotation * model.camera_from_world.rotation;
  changed.camera_from_world.translation = rotation * model.camera_from_world.translation + change.tail<3>();
  return changed;
}

// Log of the focal length, principal point as a fraction of the focal length, k1.
CameraModel with_lens_change(const CameraModel& model, const Eigen::VectorXd& change) {
  CameraModel changed = model;
  changed.lens.fx_px *= std::exp(change[0]);
  changed.lens.fy_px *= std::exp(change[0]);
  changed.lens.cx_px += change[1] * model.lens.fx_px;
  changed.lens.cy_px += change[2] * model.lens.fx_px;
  changed.lens.distortion[0] += change[3];
  return changed;
}

// One robust Gauss-Newton step with numerical derivatives; nothing if the equations are singular.
std::optional<CameraModel> step(const CameraModel& model, const std::vector<Neighbours>& neighbours,
                                const Change& changed, Eigen::Index parameters) {
  constexpr double kDelta = 1e-5;
  std::vector<CameraModel> near;
  for (Eigen::Index p = 0; p < parameters; ++p)
    near.push_back(changed(model, kDelta * Eigen::VectorXd::Unit(parameters, p)));
  Eigen::MatrixXd normal = 1e-6 * Eigen::MatrixXd::Identity(parameters, parameters);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(parameters);
  Eigen::MatrixXd slope(2, parameters);
  for (const auto& [point, blob] : neighbours) {
    const auto at = geometry::project(model, point);
    if (!at) continue;
    bool is_valid = true;
    for (Eigen::Index p = 0; p < parameters; ++p) {
      const auto moved = geometry::project(near[static_cast<std::size_t>(p)], point);
      is_valid = is_valid && moved.has_value();
      if (is_valid) slope.col(p) = (moved->v - at->v) / kDelta;
    }
    if (!is_valid) continue;
    const Eigen::Vector2d off = blob.v - at->v;
    const double weight = 1.0 / (1.0 + off.squaredNorm() / (kRobustScale_px * kRobustScale_px));
    normal += weight * slope.transpose() * slope;
    gradient += weight * slope.transpose() * off;
  }
  const Eigen::VectorXd change = normal.ldlt().solve(gradient);
  return change.allFinite() ? std::optional(changed(model, change)) : std::nullopt;
}

std::optional<CameraModel> iterate(CameraModel model, const CameraViews& camera, const Points& points,
                                   const Change& changed, Eigen::Index parameters) {
  std::size_t count = 0;
  for (const auto& each : points) count += each.size();
  for (const double gate_px : kGates_px) {
    const auto neighbours = neighbours_of(model, camera, points, gate_px);
    if (static_cast<double>(neighbours.size()) < std::max(20.0, kMinShare * static_cast<double>(count)))
      return std::nullopt;
    const auto next = step(model, neighbours, changed, parameters);
    if (!next) return std::nullopt;
    model = *next;
  }
  return model;
}

}  // namespace

std::optional<CameraModel> fit_pose(const CameraViews& camera, const Points& all_points) {
  const Points points = thinned(all_points);
  const auto rotation = RotationSearch(camera, points).best();
  if (!rotation) return std::nullopt;
  CameraModel model = camera.model;
  const WorldPoint centre = camera.model.centre();
  model.camera_from_world.rotation = *rotation;
  model.camera_from_world.translation = -(*rotation * centre.v);
  return iterate(std::move(model), camera, points, with_pose_change, static_cast<Eigen::Index>(kPoseParameters));
}

std::optional<CameraModel> fit_focal_length(const CameraViews& camera, const Points& all_points) {
  const Points points = thinned(all_points);
  CameraModel best;
  std::size_t most = 0;
  const int steps = static_cast<int>(std::log(kMaxFocalRatio) / kFocalStep);
  for (int i = -steps; i <= steps; ++i) {
    const CameraModel model = with_lens_change(camera.model, i * kFocalStep * Eigen::VectorXd::Unit(4, 0));
    const std::size_t met = neighbours_of(model, camera, points, kFocalGate_px).size();
    if (met <= most) continue;
    most = met;
    best = model;
  }
  if (most == 0) return std::nullopt;
  return iterate(std::move(best), camera, points, with_lens_change, static_cast<Eigen::Index>(kLensParameters));
}

}  // namespace mocap::calibration
