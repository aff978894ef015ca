#include "calibration/rig/fit_camera.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "calibration/bend.h"
#include "calibration/bundle_problem.h"
#include "calibration/median.h"
#include "geometry/lens.h"

namespace mocap::calibration {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kPose = 6;
constexpr int kLens = BundleProblem::kLens;
constexpr double kFewSigmas = 4.5;
constexpr int kRounds = 3;

struct Off {
  LensKind kind;
  KnownSight sight;

  template <class T>
  bool operator()(const T* pose, const T* lens, T* residual) const {
    const T point[3] = {T(sight.point.v.x()), T(sight.point.v.y()), T(sight.point.v.z())};
    T in_camera[3];
    ceres::AngleAxisRotatePoint(pose, point, in_camera);
    for (int i = 0; i < 3; ++i) in_camera[i] += pose[3 + i];
    const T depth = in_camera[2] < kNearest_m ? T(kNearest_m) : in_camera[2];
    T at[2];
    bend<T>(kind, lens, in_camera[0] / depth, in_camera[1] / depth, at);
    residual[0] = (at[0] - sight.at.v.x()) / sight.sigma_px;
    residual[1] = (at[1] - sight.at.v.y()) / sight.sigma_px;
    return true;
  }
};

struct Unknowns {
  std::array<double, kPose> pose{};
  std::array<double, kLens> lens{};

  explicit Unknowns(const CameraModel& camera)
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

double off_px(const CameraModel& camera, const KnownSight& sight) {
  const auto at = geometry::project(camera, sight.point);
  return at ? (at->v - sight.at.v).norm() : 1e9;
}

CameraDoubt doubt_of_pose(ceres::Problem& problem, const Unknowns& unknowns, const CameraModel& camera,
                          double variance) {
  ceres::Covariance covariance({});
  const double* pose = unknowns.pose.data();
  const std::vector<std::pair<const double*, const double*>> blocks{{pose, pose}};
  if (!covariance.Compute(blocks, &problem)) return {};
  Eigen::Matrix<double, kPose, kPose, Eigen::RowMajor> all;
  if (!covariance.GetCovarianceBlock(pose, pose, all.data())) return {};
  // centre = -R^T t: by the turn it moves as R^T [t]x, near enough for a standard deviation.
  Eigen::Matrix<double, 3, 6> move;
  Matrix3d cross;
  const Vector3d& t = camera.camera_from_world.translation;
  cross << 0.0, -t.z(), t.y(), t.z(), 0.0, -t.x(), -t.y(), t.x(), 0.0;
  move.leftCols<3>() = -camera.camera_from_world.rotation.transpose() * cross;
  move.rightCols<3>() = -camera.camera_from_world.rotation.transpose();
  const Eigen::Matrix<double, kPose, kPose> known = variance * all;
  return {std::sqrt((move * known * move.transpose()).trace()), std::sqrt(known.topLeftCorner<3, 3>().trace())};
}

// Least squares from `start`; only `free` parts of the lens move.
std::optional<FittedCamera> solve(const CameraModel& start, std::span<const KnownSight> sights,
                                  const std::vector<int>& free) {
  Unknowns unknowns(start);
  ceres::Problem problem;
  for (const KnownSight& sight : sights) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Off, 2, kPose, kLens>(new Off{start.lens.kind, sight}),
                             new ceres::CauchyLoss(3.0), unknowns.pose.data(), unknowns.lens.data());
  }
  if (free.empty()) {
    problem.SetParameterBlockConstant(unknowns.lens.data());
  } else if (free.size() < static_cast<std::size_t>(kLens)) {
    std::vector<int> held;
    for (int i = 0; i < kLens; ++i) {
      if (std::ranges::find(free, i) == free.end()) held.push_back(i);
    }
    problem.SetManifold(unknowns.lens.data(), new ceres::SubsetManifold(kLens, held));
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
  unknowns.write_to(fitted.camera);
  double squares = 0.0;
  double weighted = 0.0;
  for (const KnownSight& sight : sights) {
    const double off = off_px(fitted.camera, sight);
    squares += off * off;
    weighted += off * off / (sight.sigma_px * sight.sigma_px);
  }
  const double rows = 2.0 * static_cast<double>(sights.size());
  const double variance = weighted / std::max(1.0, rows - kPose - static_cast<double>(free.size()));
  fitted.rms_px = std::sqrt(squares / rows);
  fitted.used = sights.size();
  fitted.doubt = doubt_of_pose(problem, unknowns, fitted.camera, variance);
  return fitted;
}

std::optional<FittedCamera> solve_robustly(const CameraModel& start, std::span<const KnownSight> all,
                                           const std::vector<int>& free, std::size_t least) {
  std::vector<KnownSight> sights(all.begin(), all.end());
  std::optional<FittedCamera> fitted;
  for (int round = 0; round < kRounds; ++round) {
    if (sights.size() < least) return std::nullopt;
    fitted = solve(fitted ? fitted->camera : start, sights, free);
    if (!fitted) return std::nullopt;
    std::vector<double> off;
    for (const KnownSight& sight : sights) off.push_back(off_px(fitted->camera, sight));
    const double most = kFewSigmas * std::max(0.02, median(off) / 1.1774);  // the median of a Rayleigh distribution
    const auto gone =
        std::erase_if(sights, [&](const KnownSight& sight) { return off_px(fitted->camera, sight) > most; });
    if (gone == 0) break;
  }
  return fitted;
}

// Scales and shifts that bring points about the origin, at a mean distance of one.
template <int N>
Eigen::Matrix<double, N + 1, N + 1> normalising(const std::vector<Eigen::Matrix<double, N, 1>>& points) {
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

std::optional<CameraModel> by_dlt(const CameraModel& sizes, std::span<const KnownSight> sights) {
  std::vector<Vector3d> points;
  std::vector<Vector2d> seen;
  for (const KnownSight& sight : sights) {
    points.push_back(sight.point.v);
    seen.push_back(sight.at.v);
  }
  const Eigen::Matrix4d from_points = normalising<3>(points);
  const Matrix3d from_seen = normalising<2>(seen);
  Eigen::Matrix<double, 12, 12> normal = Eigen::Matrix<double, 12, 12>::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector4d x = from_points * points[i].homogeneous();
    const Vector3d u = from_seen * seen[i].homogeneous();
    Eigen::Matrix<double, 2, 12> rows = Eigen::Matrix<double, 2, 12>::Zero();
    rows.block<1, 4>(0, 0) = x.transpose();
    rows.block<1, 4>(0, 8) = -u.x() * x.transpose();
    rows.block<1, 4>(1, 4) = x.transpose();
    rows.block<1, 4>(1, 8) = -u.y() * x.transpose();
    normal += rows.transpose() * rows;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 12, 12>> eigen(normal);
  // Points in one plane leave more than one projection open.
  if (eigen.eigenvalues()[1] < 1e-9 * eigen.eigenvalues()[11]) return std::nullopt;
  const Eigen::Matrix<double, 12, 1> p = eigen.eigenvectors().col(0);
  Eigen::Matrix<double, 3, 4> projection;
  projection << p.segment<4>(0).transpose(), p.segment<4>(4).transpose(), p.segment<4>(8).transpose();
  projection = from_seen.inverse() * projection * from_points;

  // M = K R with K upper triangular: QR of M's rows from the last to the first.
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

}  // namespace

std::optional<FittedCamera> place_camera(const CameraModel& start, std::span<const KnownSight> sights) {
  return solve_robustly(start, sights, {}, 6);
}

std::optional<FittedCamera> fit_camera(const CameraModel& sizes, std::span<const KnownSight> sights) {
  if (sights.size() < 12) return std::nullopt;
  const auto start = by_dlt(sizes, sights);
  if (!start) return std::nullopt;
  const auto rough = solve(*start, sights, free_lens_parts(LensFreedom::Rough, LensKind::Pinhole));
  if (!rough) return std::nullopt;
  return solve_robustly(rough->camera, sights, {0, 1, 2, 3, 4, 5, 6, 7}, 12);
}

}  // namespace mocap::calibration
