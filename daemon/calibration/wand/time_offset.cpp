#include "calibration/wand/time_offset.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "calibration/robust_statistics.h"
#include "calibration/wand/wand_poses.h"
#include "geometry/lens.h"

namespace mocap::calibration {
namespace {

using Eigen::Vector2d;
using Vector7 = Eigen::Matrix<double, 7, 1>;
using Matrix7 = Eigen::Matrix<double, 7, 7>;

// Bounds of the number of samples. Chosen by hand; not yet measured.
constexpr std::size_t kMaxSamples = 1500;
constexpr std::size_t kMinSamples = 30;
// Consecutive samples of a long recording: all but the first and the last of a burst have a velocity. Chosen by hand.
constexpr std::size_t kBurst = 10;
// The velocity of the wand is a central difference over at most this span: over a longer one the motion is not
// straight. Chosen by hand; not yet measured.
constexpr double kMaxSpan_s = 0.12;
// A slower marker carries no information about time: 1.5 ms times 60 px/s is about the centroid noise of 0.1 px.
constexpr double kMinSpeed_px_s = 60.0;
constexpr int kIterations = 8;
// A larger time offset displaces moving markers by more than their centroid noise: at 1 m/s and 4 m, a focal length of
// 1100 px gives 0.4 px in 1.5 ms.
constexpr double kMaxTimeOffset_s = 1.5e-3;
// A time offset is reported only if it is at least this many standard deviations. Chosen by hand; not yet measured.
constexpr double kTimeOffsetSigmas = 6.0;

// 1 or more: the offset is an error.
double relative_offset(const TimeOffset& offset) {
  return std::abs(offset.late_s) / std::max(kMaxTimeOffset_s, kTimeOffsetSigmas * offset.sigma_s);
}

// One observation, linearised: unknowns are the time offset (s) and a small change of the camera's pose (rad, m).
struct Equation {
  Eigen::Matrix<double, 2, 7> jacobian;
  Vector2d residual_px;
};

// Derivative of the projection of a point by a rotation and a translation of the camera, in the camera's frame.
Eigen::Matrix<double, 2, 6> projection_jacobian(const CameraModel& camera, const WorldPoint& point) {
  const Eigen::Vector3d at = (camera.camera_from_world * point).v;
  const Vector2d ray = at.head<2>() / at.z();
  Eigen::Matrix<double, 2, 3> by_point;
  by_point << 1.0, 0.0, -ray.x(), 0.0, 1.0, -ray.y();
  by_point = geometry::distort_with_slope(camera.lens, {ray}).px_from_ray * by_point / at.z();
  Eigen::Matrix3d cross;
  cross << 0.0, at.z(), -at.y(), -at.z(), 0.0, at.x(), at.y(), -at.x(), 0.0;
  Eigen::Matrix<double, 2, 6> jacobian;
  jacobian << by_point * cross, by_point;
  return jacobian;
}

// Image velocity of an observed marker, by central differences of the neighbouring wand poses.
std::optional<Vector2d> velocity_px_s(const WandDetections& detections, const Bundle& bundle,
                                      const Observation& observation, const std::vector<int>& instant_of) {
  const auto p = static_cast<std::size_t>(observation.wand_pose);
  if (p == 0 || p + 1 >= bundle.wand_poses.size()) return std::nullopt;
  const auto at = [&](std::size_t pose) { return detections.instants[static_cast<std::size_t>(instant_of[pose])].at; };
  const double span_s = to_s(at(p + 1) - at(p - 1));
  if (!(span_s > 0.0) || span_s > kMaxSpan_s) return std::nullopt;
  const CameraModel& camera = bundle.rig[static_cast<std::size_t>(observation.camera)];
  const int last = static_cast<int>(bundle.wand.marks_m.size()) - 1;
  // The ends of a symmetric wand are in any order: the wand rotates by less than 90 degrees between two poses.
  const auto project_at = [&](const WandPose& pose) {
    const bool reversed = bundle.wand.is_symmetric() && pose.direction.dot(bundle.wand_poses[p].direction) < 0.0;
    return geometry::project(camera,
                             bundle.marker_position(pose, reversed ? last - observation.marker : observation.marker));
  };
  const auto before = project_at(bundle.wand_poses[p - 1]);
  const auto after = project_at(bundle.wand_poses[p + 1]);
  if (!before || !after) return std::nullopt;
  return (after->v - before->v) / span_s;
}

// Iteratively reweighted least squares with Cauchy weights.
TimeOffset solve_equations(const std::vector<Equation>& equations) {
  if (equations.size() < kMinSamples) return {0.0, std::numeric_limits<double>::infinity()};
  Vector7 estimate = Vector7::Zero();
  Matrix7 normal;
  double sigma_px = 0.0;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    std::vector<double> lengths;
    for (const Equation& equation : equations)
      lengths.push_back((equation.residual_px - equation.jacobian * estimate).norm());
    sigma_px = std::max(1e-3, median(lengths) / kRayleighMedian);
    normal.setZero();
    Vector7 rhs = Vector7::Zero();
    for (std::size_t i = 0; i < equations.size(); ++i) {
      const double weight = 1.0 / (1.0 + lengths[i] * lengths[i] / (9.0 * sigma_px * sigma_px));
      normal += weight * equations[i].jacobian.transpose() * equations[i].jacobian;
      rhs += weight * equations[i].jacobian.transpose() * equations[i].residual_px;
    }
    // Scaled to a unit diagonal, because the unknowns have the units s, rad and m.
    const Vector7 scale = normal.diagonal().cwiseMax(1e-12).cwiseSqrt().cwiseInverse();
    normal = scale.asDiagonal() * normal * scale.asDiagonal();
    normal.diagonal().array() += 1e-9;
    estimate = scale.asDiagonal() * normal.ldlt().solve(scale.asDiagonal() * rhs);
    normal = scale.asDiagonal() * normal.inverse() * scale.asDiagonal();
  }
  return {estimate[0], sigma_px * std::sqrt(normal(0, 0))};  // `normal` is inverted here: the covariance for 1 px
}

}  // namespace

std::vector<TimeOffset> estimate_time_offsets(const WandDetections& detections, const Bundle& bundle, double gate_px) {
  std::vector<TimeOffset> offsets;
  Bundle others{bundle.rig, bundle.wand, {}, {}};
  for (std::size_t c = 0; c < bundle.rig.size(); ++c) {
    triangulate_wand_poses(
        detections, others,
        {.gate_px = gate_px, .max_samples = kMaxSamples, .burst = kBurst, .excluded_camera = static_cast<int>(c)});
    std::vector<int> instant_of(others.wand_poses.size(), 0);
    for (const Observation& observation : others.observations)
      instant_of[static_cast<std::size_t>(observation.wand_pose)] = observation.instant;
    std::vector<Equation> equations;
    for (const Observation& observation : others.observations) {
      if (observation.camera != static_cast<int>(c)) continue;
      const auto velocity = velocity_px_s(detections, others, observation, instant_of);
      const auto residual = others.residual_px(observation);
      if (!velocity || !residual || velocity->norm() < kMinSpeed_px_s) continue;
      const WandPose& pose = others.wand_poses[static_cast<std::size_t>(observation.wand_pose)];
      Equation& equation = equations.emplace_back();
      equation.jacobian << *velocity,
          projection_jacobian(others.rig[c], others.marker_position(pose, observation.marker));
      equation.residual_px = *residual;
    }
    offsets.push_back(solve_equations(equations));
  }
  return offsets;
}

bool is_determined(const TimeOffset& offset) { return kTimeOffsetSigmas * offset.sigma_s <= kMaxTimeOffset_s; }

std::optional<std::size_t> unsynchronised_camera(std::span<const TimeOffset> offsets) {
  const auto worst = std::ranges::max_element(offsets, {}, relative_offset);
  if (worst == offsets.end() || relative_offset(*worst) < 1.0) return std::nullopt;
  return static_cast<std::size_t>(worst - offsets.begin());
}

}  // namespace mocap::calibration
