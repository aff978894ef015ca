#include "calibration/rig/resect_camera.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "calibration/bundle_problem.h"
#include "calibration/distort_ray.h"
#include "calibration/robust_statistics.h"
#include "geometry/lens.h"

namespace mocap::calibration {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kPoseSize = 6;
constexpr int kIntrinsicsSize = BundleProblem::kIntrinsicsSize;
constexpr int kMaxRounds = 3;  // of outlier removal
// Lower bound of the outlier threshold: residuals of noise-free data are rounding errors.
constexpr double kMinSigma_px = 0.02;
// 6 observations give 12 equations for 6 parameters, 12 give 24 for 14.
constexpr std::size_t kMinObservationsOfPose = 6;
constexpr std::size_t kMinObservationsOfCamera = 12;

/// ReprojectionByPose residual of one point, in units of its standard deviation.
struct ReprojectionByPose {
  LensKind kind;
  PointObservation observation;

  template <class T>
  bool operator()(const T* pose, const T* intrinsics, T* residual) const {
    const T point[3] = {T(observation.point.v.x()), T(observation.point.v.y()), T(observation.point.v.z())};
    T in_camera[3];
    ceres::AngleAxisRotatePoint(pose, point, in_camera);
    for (int i = 0; i < 3; ++i) in_camera[i] += pose[3 + i];
    const T depth = in_camera[2] < kMinDepth_m ? T(kMinDepth_m) : in_camera[2];
    T at[2];
    distort_ray<T>(kind, intrinsics, in_camera[0] / depth, in_camera[1] / depth, at);
    residual[0] = (at[0] - observation.at.v.x()) / observation.sigma_px;
    residual[1] = (at[1] - observation.at.v.y()) / observation.sigma_px;
    return true;
  }
};

/// A camera as two parameter blocks of Ceres.
struct Parameters {
  std::array<double, kPoseSize> pose{};
  std::array<double, kIntrinsicsSize> lens{};

  explicit Parameters(const CameraModel& camera)
      : lens{camera.lens.fx_px, camera.lens.fy_px, camera.lens.cx_px, camera.lens.cy_px} {
    ceres::RotationMatrixToAngleAxis(camera.camera_from_world.rotation.data(), pose.data());
    std::copy_n(camera.camera_from_world.translation.data(), 3, pose.data() + 3);
    std::copy_n(camera.lens.distortion.data(), 5, lens.data() + 4);
  }

  void write_to(CameraModel& camera) const {
    ceres::AngleAxisToRotationMatrix(pose.data(), camera.camera_from_world.rotation.data());
    std::copy_n(pose.data() + 3, 3, camera.camera_from_world.translation.data());
    camera.lens.fx_px = lens[0];
    camera.lens.fy_px = lens[1];
    camera.lens.cx_px = lens[2];
    camera.lens.cy_px = lens[3];
    std::copy_n(lens.data() + 4, 5, camera.lens.distortion.data());
  }
};

// Infinite for practical purposes if the point is not in front of the camera.
double residual_length_px(const CameraModel& camera, const PointObservation& observation) {
  const auto at = geometry::project(camera, observation.point);
  return at ? (at->v - observation.at.v).norm() : 1e9;
}

// Nothing if the normal equations of the pose are singular.
std::optional<PoseUncertainty> pose_uncertainty(ceres::Problem& problem, const Parameters& parameters,
                                                const CameraModel& camera, double variance) {
  ceres::Covariance covariance({});
  const double* pose = parameters.pose.data();
  const std::vector<std::pair<const double*, const double*>> blocks{{pose, pose}};
  if (!covariance.Compute(blocks, &problem)) return std::nullopt;
  Eigen::Matrix<double, kPoseSize, kPoseSize, Eigen::RowMajor> all;
  if (!covariance.GetCovarianceBlock(pose, pose, all.data())) return std::nullopt;
  // centre = -R^T t, so its derivative by a small rotation is -R^T [t]x to first order.
  Eigen::Matrix<double, 3, 6> jacobian;
  Matrix3d cross;
  const Vector3d& t = camera.camera_from_world.translation;
  cross << 0.0, -t.z(), t.y(), t.z(), 0.0, -t.x(), -t.y(), t.x(), 0.0;
  jacobian.leftCols<3>() = -camera.camera_from_world.rotation.transpose() * cross;
  jacobian.rightCols<3>() = -camera.camera_from_world.rotation.transpose();
  const Eigen::Matrix<double, kPoseSize, kPoseSize> scaled = variance * all;
  const PoseUncertainty uncertainty{std::sqrt((jacobian * scaled * jacobian.transpose()).trace()),
                                    std::sqrt(scaled.topLeftCorner<3, 3>().trace())};
  if (!std::isfinite(uncertainty.position_m) || !std::isfinite(uncertainty.rotation_rad)) return std::nullopt;
  return uncertainty;
}

// Robust least squares from `start`. `free`: indices of the free intrinsic parameters.
std::optional<FittedCamera> solve(const CameraModel& start, std::span<const PointObservation> observations,
                                  const std::vector<int>& free) {
  Parameters parameters(start);
  ceres::Problem problem;
  for (const PointObservation& observation : observations) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<ReprojectionByPose, 2, kPoseSize, kIntrinsicsSize>(
                                 new ReprojectionByPose{start.lens.kind, observation}),
                             new ceres::CauchyLoss(3.0), parameters.pose.data(), parameters.lens.data());
  }
  if (free.empty()) {
    problem.SetParameterBlockConstant(parameters.lens.data());
  } else if (free.size() < static_cast<std::size_t>(kIntrinsicsSize)) {
    std::vector<int> constant;
    for (int i = 0; i < kIntrinsicsSize; ++i) {
      if (std::ranges::find(free, i) == free.end()) constant.push_back(i);
    }
    problem.SetManifold(parameters.lens.data(), new ceres::SubsetManifold(kIntrinsicsSize, constant));
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.max_num_iterations = 100;
  options.function_tolerance = 1e-10;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable()) return std::nullopt;
  FittedCamera fitted;
  fitted.camera = start;
  parameters.write_to(fitted.camera);
  double squares = 0.0;
  double weighted = 0.0;
  for (const PointObservation& observation : observations) {
    const double length = residual_length_px(fitted.camera, observation);
    squares += length * length;
    weighted += length * length / (observation.sigma_px * observation.sigma_px);
  }
  const double rows = 2.0 * static_cast<double>(observations.size());
  const double variance = weighted / std::max(1.0, rows - kPoseSize - static_cast<double>(free.size()));
  fitted.rms_px = std::sqrt(squares / rows);
  fitted.used = observations.size();
  fitted.uncertainty = pose_uncertainty(problem, parameters, fitted.camera, variance);
  return fitted;
}

std::optional<FittedCamera> solve_robustly(const CameraModel& start, std::span<const PointObservation> all,
                                           const std::vector<int>& free, std::size_t min_observations) {
  std::vector<PointObservation> observations(all.begin(), all.end());
  std::optional<FittedCamera> fitted;
  for (int round = 0; round < kMaxRounds; ++round) {
    if (observations.size() < min_observations) return std::nullopt;
    fitted = solve(fitted ? fitted->camera : start, observations, free);
    if (!fitted) return std::nullopt;
    std::vector<double> lengths;
    for (const PointObservation& observation : observations)
      lengths.push_back(residual_length_px(fitted->camera, observation));
    const double max_px = kOutlierSigmas * std::max(kMinSigma_px, median(lengths) / kRayleighMedian);
    const auto removed = std::erase_if(observations, [&](const PointObservation& observation) {
      return residual_length_px(fitted->camera, observation) > max_px;
    });
    if (removed == 0) break;
  }
  return fitted;
}

// The similarity that moves the mean of points to the origin and their mean distance to one (Hartley normalisation).
template <int N>
Eigen::Matrix<double, N + 1, N + 1> normalisation(const std::vector<Eigen::Matrix<double, N, 1>>& points) {
  Eigen::Matrix<double, N, 1> mean = Eigen::Matrix<double, N, 1>::Zero();
  for (const auto& point : points) mean += point / static_cast<double>(points.size());
  double distance = 0.0;
  for (const auto& point : points) distance += (point - mean).norm() / static_cast<double>(points.size());
  Eigen::Matrix<double, N + 1, N + 1> to = Eigen::Matrix<double, N + 1, N + 1>::Identity();
  const double scale = 1.0 / std::max(1e-12, distance);
  to.template topLeftCorner<N, N>() *= scale;
  to.template topRightCorner<N, 1>() = -scale * mean;
  return to;
}

// Splits a 3 x 4 projection matrix into intrinsics, rotation and translation (RQ decomposition of its left 3 x 3 part).
std::optional<CameraModel> decompose(Eigen::Matrix<double, 3, 4> projection, const CameraModel& sizes) {
  Matrix3d m = projection.leftCols<3>();
  const double sign = m.determinant() < 0.0 ? -1.0 : 1.0;
  projection *= sign;
  m = projection.leftCols<3>();
  Matrix3d flip;
  flip << 0, 0, 1, 0, 1, 0, 1, 0, 0;
  const Eigen::HouseholderQR<Matrix3d> qr((flip * m).transpose());
  Matrix3d k = flip * Matrix3d(Matrix3d(qr.matrixQR().triangularView<Eigen::Upper>()).transpose()) * flip;
  Matrix3d r = flip * Matrix3d(Matrix3d(qr.householderQ()).transpose());
  for (int i = 0; i < 3; ++i) {
    if (k(i, i) >= 0.0) continue;
    k.col(i) = -k.col(i);
    r.row(i) = -r.row(i);
  }
  if (!(std::abs(k(2, 2)) > 1e-12) || r.determinant() < 0.0) return std::nullopt;
  CameraModel camera = sizes;
  camera.camera_from_world.rotation = r;
  camera.camera_from_world.translation = k.inverse() * projection.col(3);
  k /= k(2, 2);
  camera.lens = {LensKind::Pinhole, k(0, 0), k(1, 1), k(0, 2), k(1, 2)};
  return camera;
}

std::optional<CameraModel> direct_linear_transform(const CameraModel& sizes,
                                                   std::span<const PointObservation> observations) {
  std::vector<Vector3d> points;
  std::vector<Vector2d> image_points;
  for (const PointObservation& observation : observations) {
    points.push_back(observation.point.v);
    image_points.push_back(observation.at.v);
  }
  const Eigen::Matrix4d from_points = normalisation<3>(points);
  const Matrix3d from_image_points = normalisation<2>(image_points);
  Eigen::Matrix<double, 12, 12> normal = Eigen::Matrix<double, 12, 12>::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector4d x = from_points * points[i].homogeneous();
    const Vector3d u = from_image_points * image_points[i].homogeneous();
    Eigen::Matrix<double, 2, 12> rows = Eigen::Matrix<double, 2, 12>::Zero();
    rows.block<1, 4>(0, 0) = x.transpose();
    rows.block<1, 4>(0, 8) = -u.x() * x.transpose();
    rows.block<1, 4>(1, 4) = x.transpose();
    rows.block<1, 4>(1, 8) = -u.y() * x.transpose();
    normal += rows.transpose() * rows;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 12, 12>> eigen(normal);
  // Coplanar points: the null space has more than one dimension.
  if (eigen.eigenvalues()[1] < 1e-9 * eigen.eigenvalues()[11]) return std::nullopt;
  const Eigen::Matrix<double, 12, 1> p = eigen.eigenvectors().col(0);
  Eigen::Matrix<double, 3, 4> projection;
  projection << p.segment<4>(0).transpose(), p.segment<4>(4).transpose(), p.segment<4>(8).transpose();
  projection = from_image_points.inverse() * projection * from_points;
  return decompose(projection, sizes);
}

}  // namespace

std::optional<FittedCamera> resect_pose(const CameraModel& start, std::span<const PointObservation> observations) {
  return solve_robustly(start, observations, {}, kMinObservationsOfPose);
}

std::optional<FittedCamera> resect_camera(const CameraModel& sizes, std::span<const PointObservation> observations) {
  if (observations.size() < kMinObservationsOfCamera) return std::nullopt;
  const auto start = direct_linear_transform(sizes, observations);
  if (!start) return std::nullopt;
  const auto rough =
      solve(*start, observations, free_intrinsic_indices(FreeIntrinsics::FocalLengthsAndK1, LensKind::Pinhole));
  if (!rough) return std::nullopt;
  return solve_robustly(rough->camera, observations, {0, 1, 2, 3, 4, 5, 6, 7}, kMinObservationsOfCamera);
}

}  // namespace mocap::calibration
