#include "calibration/rig/previous_rig.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "base/expects.h"
#include "calibration/robust_statistics.h"
#include "geometry/rigid_fit.h"

namespace mocap::calibration {
namespace {

// Chosen by hand; not yet measured.
constexpr double kRatioTolerance = 0.005;
constexpr double kMinAgreement = 0.6;
// A camera that deviates by less was not moved. Chosen by hand; not yet measured.
constexpr double kMaxDeviation_m = 0.01;
// Cameras of a rig without extrinsics are all at the origin.
constexpr double kMinDistance_m = 0.05;
// The ends of the camera axes at this distance are fitted like the centres: they determine the rotation about a line of
// cameras. Short, so that they count little where the centres determine the rotation. Chosen by hand.
constexpr double kAxisLever_m = 0.3;
// A camera that is rotated by more was aimed anew. An estimated principal point that is wrong by 10 px rotates a camera
// by 0.5 degrees. Chosen by hand; not yet measured.
constexpr double kMaxRotation_rad = std::numbers::pi / 180.0;

struct CameraInBoth {
  const CameraModel* now;
  const CameraModel* before;
  bool is_aimed_as_before = true;
};

std::optional<Pose> fit_world(const std::vector<CameraInBoth>& cameras) {
  std::vector<geometry::PointPair> points;
  for (const auto& [now, before, is_aimed_as_before] : cameras) {
    const Eigen::Vector3d from = now->centre().v;
    const Eigen::Vector3d to = before->centre().v;
    points.push_back({from, to});
    for (int axis = 0; axis < 3 && is_aimed_as_before; ++axis) {
      points.push_back({from + kAxisLever_m * now->camera_from_world.rotation.row(axis).transpose(),
                        to + kAxisLever_m * before->camera_from_world.rotation.row(axis).transpose()});
    }
  }
  const auto fit = geometry::fit_rigid(points);
  return fit ? std::optional(fit->to_from) : std::nullopt;
}

double centre_distance_m(const CameraInBoth& camera, const Pose& previous_from_rig) {
  return (previous_from_rig * camera.now->centre().v - camera.before->centre().v).norm();
}

// The deviations of a camera in units of the largest one of an unmoved camera.
double relative_shift(const CameraInBoth& camera, const Pose& previous_from_rig) {
  return centre_distance_m(camera, previous_from_rig) / kMaxDeviation_m;
}

// 0 for a camera of which only the centre is compared.
double relative_rotation(const CameraInBoth& camera, const Pose& previous_from_rig) {
  if (!camera.is_aimed_as_before) return 0.0;
  const Eigen::AngleAxisd rotation(
      Eigen::Matrix3d(camera.before->camera_from_world.rotation * previous_from_rig.rotation.toRotationMatrix() *
                      camera.now->camera_from_world.rotation.transpose()));
  return std::abs(rotation.angle()) / kMaxRotation_rad;
}

// Whether centres that are wrong by kMaxDeviation_m rotate the world by less than kMaxRotation_rad, also about the line
// that is nearest to all centres: the second singular value is the root of the summed squared distances from this line,
// in the direction in which they are larger.
bool centres_determine_rotation(const std::vector<CameraInBoth>& cameras) {
  Eigen::Matrix3Xd centres_m(3, static_cast<Eigen::Index>(cameras.size()));
  for (std::size_t c = 0; c < cameras.size(); ++c)
    centres_m.col(static_cast<Eigen::Index>(c)) = cameras[c].before->centre().v;
  centres_m.colwise() -= Eigen::Vector3d(centres_m.rowwise().mean());
  return Eigen::JacobiSVD<Eigen::Matrix3Xd>(centres_m).singularValues()[1] * kMaxRotation_rad > kMaxDeviation_m;
}

double rms_of_centres_m(const std::vector<CameraInBoth>& cameras, const Pose& previous_from_rig) {
  double squares = 0.0;
  for (const CameraInBoth& camera : cameras) squares += std::pow(centre_distance_m(camera, previous_from_rig), 2);
  return std::sqrt(squares / static_cast<double>(cameras.size()));
}

}  // namespace

std::optional<double> scale_of_previous(const Rig& rig, const Rig& previous) {
  MOCAP_EXPECTS(rig.size() == previous.size());
  if (rig.size() < 3) return std::nullopt;
  std::vector<double> ratios;
  for (std::size_t a = 0; a < rig.size(); ++a) {
    for (std::size_t b = a + 1; b < rig.size(); ++b) {
      const double before = (previous[a].centre().v - previous[b].centre().v).norm();
      if (before < kMinDistance_m) return std::nullopt;
      ratios.push_back((rig[a].centre().v - rig[b].centre().v).norm() / before);
    }
  }
  const double scale = median(ratios);
  const auto agreeing =
      std::ranges::count_if(ratios, [&](double r) { return std::abs(r / scale - 1.0) < kRatioTolerance; });
  if (static_cast<double>(agreeing) < kMinAgreement * static_cast<double>(ratios.size())) return std::nullopt;
  return scale;
}

std::optional<Floor> pose_in_previous_world(const Rig& rig, const Rig& previous) {
  MOCAP_EXPECTS(rig.size() == previous.size());
  std::vector<CameraInBoth> cameras;
  for (std::size_t c = 0; c < rig.size(); ++c) cameras.push_back({&rig[c], &previous[c]});
  const std::size_t half = (rig.size() + 1) / 2;
  while (cameras.size() >= std::max<std::size_t>(3, half)) {
    const auto previous_from_rig = fit_world(cameras);
    if (!previous_from_rig) return std::nullopt;
    const auto shift = [&](const CameraInBoth& camera) { return relative_shift(camera, *previous_from_rig); };
    const auto rotation = [&](const CameraInBoth& camera) { return relative_rotation(camera, *previous_from_rig); };
    const auto moved = std::ranges::max_element(cameras, {}, shift);
    const auto rotated = std::ranges::max_element(cameras, {}, rotation);
    if (std::max(shift(*moved), rotation(*rotated)) < 1.0) {
      const auto aimed = std::ranges::count_if(cameras, &CameraInBoth::is_aimed_as_before);
      const bool enough = static_cast<std::size_t>(aimed) >= std::max<std::size_t>(2, half);
      if (!enough && !centres_determine_rotation(cameras)) return std::nullopt;
      return Floor{*previous_from_rig, rms_of_centres_m(cameras, *previous_from_rig)};
    }
    if (rotation(*rotated) > shift(*moved)) {
      rotated->is_aimed_as_before = false;
    } else {
      cameras.erase(moved);
    }
  }
  return std::nullopt;
}

}  // namespace mocap::calibration
