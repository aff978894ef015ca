#include "calibration/wand/time_offset.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "calibration/median.h"
#include "calibration/wand/place_wand.h"
#include "geometry/lens.h"

namespace mocap::calibration {
namespace {

using Eigen::Vector2d;

constexpr std::size_t kMostSamples = 1500;
constexpr std::size_t kLeastSamples = 30;
// Between two places further apart in time the wand did not go straight.
constexpr double kStraight_s = 0.12;
constexpr double kLeastMotion_px_s = 60.0;

// One sight: what a lag of a second, and a small turn and move of the camera, would make of it, px.
struct Row {
  Eigen::Matrix<double, 2, 7> slope;
  Vector2d off;
};

// How a sight moves with the camera's pose: without it, a pose that was solved with late pictures hides part of the
// lag.
Eigen::Matrix<double, 2, 6> slope_of_pose(const CameraModel& camera, const WorldPoint& point) {
  const Eigen::Vector3d at = (camera.camera_from_world * point).v;
  const Vector2d ray = at.head<2>() / at.z();
  Eigen::Matrix<double, 2, 3> move;
  move << 1.0, 0.0, -ray.x(), 0.0, 1.0, -ray.y();
  move = geometry::distort_with_slope(camera.lens, {ray}).px_from_ray * move / at.z();
  Eigen::Matrix3d cross;
  cross << 0.0, at.z(), -at.y(), -at.z(), 0.0, at.x(), at.y(), -at.x(), 0.0;
  Eigen::Matrix<double, 2, 6> slope;
  slope << move * cross, move;
  return slope;
}

// Where the wand's motion at a place leads in a camera's image, px/s: from the places before and after.
std::optional<Vector2d> motion_px_s(const WandViews& views, const Bundle& bundle, const Sight& sight,
                                    const std::vector<int>& instant_of) {
  const auto p = static_cast<std::size_t>(sight.place);
  if (p == 0 || p + 1 >= bundle.places.size()) return std::nullopt;
  const auto at = [&](std::size_t place) { return views.instants[static_cast<std::size_t>(instant_of[place])].at; };
  const double span_s = to_s(at(p + 1) - at(p - 1));
  if (!(span_s > 0.0) || span_s > kStraight_s) return std::nullopt;
  const CameraModel& camera = bundle.rig[static_cast<std::size_t>(sight.camera)];
  const auto before = geometry::project(camera, bundle.marker(bundle.places[p - 1], sight.mark));
  const auto after = geometry::project(camera, bundle.marker(bundle.places[p + 1], sight.mark));
  if (!before || !after) return std::nullopt;
  return (after->v - before->v) / span_s;
}

// Least squares for lag and pose at once; what is far off counts less and less.
TimeOffset offset_of(const std::vector<Row>& rows) {
  if (rows.size() < kLeastSamples) return {0.0, std::numeric_limits<double>::infinity()};
  Eigen::Matrix<double, 7, 1> change = Eigen::Matrix<double, 7, 1>::Zero();
  Eigen::Matrix<double, 7, 7> curvature;
  double spread = 0.0;
  for (int round = 0; round < 8; ++round) {
    std::vector<double> off;
    for (const Row& row : rows) off.push_back((row.off - row.slope * change).norm());
    spread = std::max(1e-3, median(off) / 1.1774);  // the median of a Rayleigh distribution
    curvature.setZero();
    Eigen::Matrix<double, 7, 1> pull = Eigen::Matrix<double, 7, 1>::Zero();
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double weight = 1.0 / (1.0 + off[i] * off[i] / (9.0 * spread * spread));
      curvature += weight * rows[i].slope.transpose() * rows[i].slope;
      pull += weight * rows[i].slope.transpose() * rows[i].off;
    }
    // Scaled, since s, rad and m stand side by side.
    const Eigen::Matrix<double, 7, 1> scale = curvature.diagonal().cwiseMax(1e-12).cwiseSqrt().cwiseInverse();
    curvature = scale.asDiagonal() * curvature * scale.asDiagonal();
    curvature.diagonal().array() += 1e-9;
    change = scale.asDiagonal() * curvature.ldlt().solve(scale.asDiagonal() * pull);
    curvature = scale.asDiagonal() * curvature.inverse() * scale.asDiagonal();
  }
  return {change[0], spread * std::sqrt(curvature(0, 0))};
}

}  // namespace

std::vector<TimeOffset> time_offsets(const WandViews& views, const Bundle& bundle, double gate_px) {
  std::vector<TimeOffset> offsets;
  Bundle placed{bundle.rig, bundle.wand, {}, {}};
  for (std::size_t c = 0; c < bundle.rig.size(); ++c) {
    place_wand(views, placed, {.gate_px = gate_px, .most_samples = kMostSamples, .without = static_cast<int>(c)});
    std::vector<int> instant_of(placed.places.size(), 0);
    for (const Sight& sight : placed.sights) instant_of[static_cast<std::size_t>(sight.place)] = sight.picture;
    std::vector<Row> rows;
    for (const Sight& sight : placed.sights) {
      if (sight.camera != static_cast<int>(c)) continue;
      const auto motion = motion_px_s(views, placed, sight, instant_of);
      const auto residual = placed.residual_px(sight);
      if (!motion || !residual || motion->norm() < kLeastMotion_px_s) continue;
      const WorldPoint at = placed.marker(placed.places[static_cast<std::size_t>(sight.place)], sight.mark);
      Row& row = rows.emplace_back();
      row.slope << *motion, slope_of_pose(placed.rig[c], at);
      row.off = *residual;
    }
    offsets.push_back(offset_of(rows));
  }
  return offsets;
}

}  // namespace mocap::calibration
