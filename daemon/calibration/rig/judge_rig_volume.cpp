#include "calibration/rig/judge_rig_volume.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "geometry/lens.h"

namespace mocap::calibration {
namespace {

using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Matrix23 = Eigen::Matrix<double, 2, 3>;

constexpr std::size_t kLeastPoints = 10;
constexpr int kSlices = 4;
constexpr int kMostColumns = 28;
// A point that is known to no better than this, m, is not located at all.
constexpr double kHopeless_m = 10.0;
// What of the points the box leaves out at either end of each axis: strays.
constexpr double kStrays = 0.01;
constexpr double kLeastSide_m = 0.2;

// How a point moves in the camera's image as it moves in the world; nothing where the camera does not see it.
std::optional<Matrix23> slope_in_image(const CameraModel& camera, const Vector3d& point_m) {
  const auto pixel = geometry::project(camera, {point_m});
  if (!pixel || !geometry::in_image(camera, *pixel)) return std::nullopt;
  const Vector3d seen = (camera.camera_from_world * WorldPoint{point_m}).v;
  const NormalizedPoint ray{seen.head<2>() / seen.z()};
  Matrix23 ray_from_seen;
  ray_from_seen << 1.0, 0.0, -ray.v.x(), 0.0, 1.0, -ray.v.y();
  return Matrix23(geometry::distort_with_slope(camera.lens, ray).px_from_ray * ray_from_seen / seen.z() *
                  camera.camera_from_world.rotation);
}

Matrix3d cross(const Vector3d& v) {
  Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

double percentile(std::vector<double>& values, double share) {
  const auto at = static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

void lay_box(const std::vector<Vector3d>& points, VolumeUncertainty& volume) {
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> along;
    for (const Vector3d& point : points) along.push_back(point[axis]);
    volume.from_m[axis] = percentile(along, kStrays);
    volume.to_m[axis] = percentile(along, 1.0 - kStrays);
    const double lacking = kLeastSide_m - (volume.to_m[axis] - volume.from_m[axis]);
    if (lacking <= 0.0) continue;
    volume.from_m[axis] -= 0.5 * lacking;
    volume.to_m[axis] += 0.5 * lacking;
  }
  const Vector3d size = volume.to_m - volume.from_m;
  const double cell = std::max(size.x(), size.y()) / kMostColumns;
  volume.columns = std::max(1, static_cast<int>(std::round(size.x() / cell)));
  volume.rows = std::max(1, static_cast<int>(std::round(size.y() / cell)));
}

}  // namespace

std::optional<double> position_sigma_m(const Rig& rig, const MatrixXd& covariance, double sigma_px,
                                       const Vector3d& point_m) {
  Matrix3d information = Matrix3d::Zero();
  MatrixXd pull = MatrixXd::Zero(3, 6 * static_cast<Eigen::Index>(rig.size()));  // of each camera's place and turn
  int seen = 0;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const auto slope = slope_in_image(rig[c], point_m);
    if (!slope) continue;
    ++seen;
    const Matrix3d own = slope->transpose() * *slope;
    information += own;
    // Whoever is moved sees the point moved the other way; turned by w, from d to d x w.
    const auto first = 6 * static_cast<Eigen::Index>(c);
    pull.block<3, 3>(0, first) = -own;
    pull.block<3, 3>(0, first + 3) = own * cross(point_m - rig[c].centre().v);
  }
  if (seen < 2) return std::nullopt;
  const Eigen::LDLT<Matrix3d> solver(information);
  Matrix3d result = sigma_px * sigma_px * solver.solve(Matrix3d::Identity());
  if (covariance.rows() == pull.cols() && covariance.cols() == pull.cols()) {
    const MatrixXd moved = solver.solve(pull);
    result += moved * covariance * moved.transpose();
  }
  const double sigma = std::sqrt(result.trace());
  if (!(sigma < kHopeless_m)) return std::nullopt;
  return sigma;
}

std::optional<VolumeUncertainty> uncertainty_over(const std::vector<Vector3d>& points_m, const Rig& rig,
                                                  const MatrixXd& covariance, double sigma_px) {
  if (points_m.size() < kLeastPoints) return std::nullopt;
  VolumeUncertainty volume;
  lay_box(points_m, volume);
  const Vector3d size = volume.to_m - volume.from_m;
  std::vector<double> seen;
  for (int slice = 0; slice < kSlices; ++slice) {
    volume.heights_m.push_back(volume.from_m.z() + size.z() * (slice + 0.5) / kSlices);
    std::vector<double>& sigmas = volume.sigma_m.emplace_back();
    for (int row = 0; row < volume.rows; ++row) {
      for (int column = 0; column < volume.columns; ++column) {
        const Vector3d point(volume.from_m.x() + size.x() * (column + 0.5) / volume.columns,
                             volume.from_m.y() + size.y() * (row + 0.5) / volume.rows, volume.heights_m.back());
        const auto sigma = position_sigma_m(rig, covariance, sigma_px, point);
        sigmas.push_back(sigma.value_or(std::numeric_limits<double>::infinity()));
        if (sigma) seen.push_back(*sigma);
      }
    }
  }
  const double all = kSlices * volume.rows * volume.columns;
  volume.unseen_share = 1.0 - static_cast<double>(seen.size()) / all;
  if (!seen.empty()) {
    volume.median_m = percentile(seen, 0.5);
    volume.p90_m = percentile(seen, 0.9);
  }
  return volume;
}

}  // namespace mocap::calibration
