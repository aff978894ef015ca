#include "calibration/rig/volume_uncertainty.h"

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

// Grid and bounds chosen by hand.
constexpr std::size_t kMinVolumePoints = 10;
constexpr int kSlices = 4;
constexpr int kMaxColumns = 28;
// A larger standard deviation counts as unseen: the rays are nearly parallel. Chosen by hand.
constexpr double kMaxSigma_m = 10.0;
// Fraction of the points that the box leaves out at either end of each axis.
constexpr double kOutlierFraction = 0.01;
constexpr double kMinSide_m = 0.2;

// Derivative of the projection by the point; nothing if the point is not in the camera's image.
std::optional<Matrix23> pixel_jacobian_of_point(const CameraModel& camera, const Vector3d& point_m) {
  const auto pixel = geometry::project(camera, {point_m});
  if (!pixel || !geometry::in_image(camera, *pixel)) return std::nullopt;
  const Vector3d in_camera = (camera.camera_from_world * WorldPoint{point_m}).v;
  const NormalizedPoint ray{in_camera.head<2>() / in_camera.z()};
  Matrix23 ray_from_point;
  ray_from_point << 1.0, 0.0, -ray.v.x(), 0.0, 1.0, -ray.v.y();
  return Matrix23(geometry::distort_with_slope(camera.lens, ray).px_from_ray * ray_from_point / in_camera.z() *
                  camera.camera_from_world.rotation);
}

Matrix3d cross(const Vector3d& v) {
  Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

double percentile(std::vector<double>& values, double fraction) {
  const auto at = static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

void fit_box(const std::vector<Vector3d>& points, VolumeUncertainty& volume) {
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> along;
    for (const Vector3d& point : points) along.push_back(point[axis]);
    volume.from_m[axis] = percentile(along, kOutlierFraction);
    volume.to_m[axis] = percentile(along, 1.0 - kOutlierFraction);
    const double missing = kMinSide_m - (volume.to_m[axis] - volume.from_m[axis]);
    if (missing <= 0.0) continue;
    volume.from_m[axis] -= 0.5 * missing;
    volume.to_m[axis] += 0.5 * missing;
  }
  const Vector3d size = volume.to_m - volume.from_m;
  const double cell = std::max(size.x(), size.y()) / kMaxColumns;
  volume.columns = std::max(1, static_cast<int>(std::round(size.x() / cell)));
  volume.rows = std::max(1, static_cast<int>(std::round(size.y() / cell)));
}

}  // namespace

std::optional<double> position_sigma_m(const Rig& rig, const MatrixXd& covariance, double sigma_px,
                                       const Vector3d& point_m) {
  Matrix3d information = Matrix3d::Zero();
  MatrixXd rhs =
      MatrixXd::Zero(3, 6 * static_cast<Eigen::Index>(rig.size()));  // by position and rotation of each camera
  int visible = 0;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    const auto jacobian = pixel_jacobian_of_point(rig[c], point_m);
    if (!jacobian) continue;
    ++visible;
    const Matrix3d information_of_camera = jacobian->transpose() * *jacobian;
    information += information_of_camera;
    // A displacement of the camera displaces its ray to the point; so does a rotation w, by w x d.
    const auto first = 6 * static_cast<Eigen::Index>(c);
    rhs.block<3, 3>(0, first) = -information_of_camera;
    rhs.block<3, 3>(0, first + 3) = information_of_camera * cross(point_m - rig[c].centre().v);
  }
  if (visible < 2) return std::nullopt;
  const Eigen::LDLT<Matrix3d> solver(information);
  Matrix3d result = sigma_px * sigma_px * solver.solve(Matrix3d::Identity());
  if (covariance.rows() == rhs.cols() && covariance.cols() == rhs.cols()) {
    const MatrixXd point_by_cameras = solver.solve(rhs);
    result += point_by_cameras * covariance * point_by_cameras.transpose();
  }
  const double sigma = std::sqrt(result.trace());
  if (!(sigma < kMaxSigma_m)) return std::nullopt;
  return sigma;
}

std::optional<VolumeUncertainty> volume_uncertainty(const std::vector<Vector3d>& points_m, const Rig& rig,
                                                    const MatrixXd& covariance, double sigma_px) {
  if (points_m.size() < kMinVolumePoints) return std::nullopt;
  VolumeUncertainty volume;
  fit_box(points_m, volume);
  const Vector3d size = volume.to_m - volume.from_m;
  std::vector<double> visible;
  for (int slice = 0; slice < kSlices; ++slice) {
    volume.heights_m.push_back(volume.from_m.z() + size.z() * (slice + 0.5) / kSlices);
    std::vector<double>& sigmas = volume.sigma_m.emplace_back();
    for (int row = 0; row < volume.rows; ++row) {
      for (int column = 0; column < volume.columns; ++column) {
        const Vector3d point(volume.from_m.x() + size.x() * (column + 0.5) / volume.columns,
                             volume.from_m.y() + size.y() * (row + 0.5) / volume.rows, volume.heights_m.back());
        const auto sigma = position_sigma_m(rig, covariance, sigma_px, point);
        sigmas.push_back(sigma.value_or(std::numeric_limits<double>::infinity()));
        if (sigma) visible.push_back(*sigma);
      }
    }
  }
  const double all = kSlices * volume.rows * volume.columns;
  volume.unseen_fraction = 1.0 - static_cast<double>(visible.size()) / all;
  if (!visible.empty()) {
    volume.median_m = percentile(visible, 0.5);
    volume.p90_m = percentile(visible, 0.9);
  }
  return volume;
}

}  // namespace mocap::calibration
