#include "calibration/rig/refine_rig.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <array>
#include <cmath>

#include "calibration/distort_ray.h"
#include "calibration/robust_statistics.h"
#include "geometry/lens.h"

namespace mocap::calibration {
namespace {

/// Reprojection residual of one marker with constant intrinsics, in units of its standard deviation.
struct Reprojection {
  const CameraModel* camera;
  Eigen::Vector2d px;
  double sigma_px;

  template <class T>
  bool operator()(const T* pose, const T* point, T* residual) const {
    T in_camera[3];
    ceres::AngleAxisRotatePoint(pose, point, in_camera);
    for (int i = 0; i < 3; ++i) in_camera[i] += pose[3 + i];
    const T depth = in_camera[2] < kMinDepth_m ? T(kMinDepth_m) : in_camera[2];
    const Lens& intrinsics = camera->lens;
    T lens[9] = {T(intrinsics.fx_px), T(intrinsics.fy_px), T(intrinsics.cx_px), T(intrinsics.cy_px)};
    for (int i = 0; i < 5; ++i) lens[4 + i] = T(intrinsics.distortion[i]);
    T at[2];
    distort_ray<T>(intrinsics.kind, lens, in_camera[0] / depth, in_camera[1] / depth, at);
    residual[0] = (at[0] - px.x()) / sigma_px;
    residual[1] = (at[1] - px.y()) / sigma_px;
    return true;
  }
};

/// Gaussian prior of a camera's pose, about its initial pose.
struct PosePrior {
  std::array<double, 6> pose;
  Eigen::Vector3d centre;
  double position_sigma_m;
  double rotation_sigma_rad;

  template <class T>
  bool operator()(const T* now, T* residual) const {
    const T back[3] = {-now[0], -now[1], -now[2]};
    T at[3];
    ceres::AngleAxisRotatePoint(back, now + 3, at);
    for (int i = 0; i < 3; ++i) {
      residual[i] = (-at[i] - centre[i]) / position_sigma_m;
      residual[3 + i] = (now[i] - pose[static_cast<std::size_t>(i)]) / rotation_sigma_rad;
    }
    return true;
  }
};

using Poses = std::vector<std::array<double, 6>>;

Poses poses_of(const Rig& rig) {
  Poses poses;
  for (const CameraModel& camera : rig) {
    auto& pose = poses.emplace_back();
    ceres::RotationMatrixToAngleAxis(camera.camera_from_world.rotation.data(), pose.data());
    std::copy_n(camera.camera_from_world.translation.data(), 3, pose.data() + 3);
  }
  return poses;
}

double robust_rms_px(const Rig& rig, const std::vector<ObservedMarker>& markers,
                     const std::vector<std::array<double, 3>>& points) {
  std::vector<double> lengths;
  for (std::size_t m = 0; m < markers.size(); ++m) {
    for (const MarkerObservation& observation : markers[m].observations) {
      const auto at = geometry::project(rig[static_cast<std::size_t>(observation.camera)],
                                        {Eigen::Vector3d(points[m][0], points[m][1], points[m][2])});
      if (at) lengths.push_back((at->v - observation.at.v).norm());
    }
  }
  return lengths.empty() ? 0.0 : median(lengths) / kRayleighMedian;
}

}  // namespace

std::optional<RefinedRig> refine_rig(const Rig& rig, const std::vector<ObservedMarker>& markers,
                                     const RefineRigSettings& settings) {
  if (markers.size() < kMinRefinedMarkers) return std::nullopt;
  Poses poses = poses_of(rig);
  std::vector<std::array<double, 3>> points;
  for (const ObservedMarker& marker : markers)
    points.push_back({marker.point.v.x(), marker.point.v.y(), marker.point.v.z()});
  RefinedRig refined{rig, robust_rms_px(rig, markers, points), 0.0};

  ceres::Problem problem;
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  auto* const loss = new ceres::CauchyLoss(3.0);
  for (std::size_t m = 0; m < markers.size(); ++m) {
    for (const MarkerObservation& observation : markers[m].observations) {
      const auto c = static_cast<std::size_t>(observation.camera);
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Reprojection, 2, 6, 3>(
                                   new Reprojection{&rig[c], observation.at.v, observation.sigma_px}),
                               loss, poses[c].data(), points[m].data());
    }
    if (!markers[m].observations.empty()) ordering->AddElementToGroup(points[m].data(), 0);
  }
  for (std::size_t c = 0; c < rig.size(); ++c) {
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<PosePrior, 6, 6>(new PosePrior{
                                 poses[c], rig[c].centre().v, settings.position_prior_m, settings.rotation_prior_rad}),
                             nullptr, poses[c].data());
    ordering->AddElementToGroup(poses[c].data(), 1);
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_SCHUR;
  options.linear_solver_ordering = ordering;
  options.max_num_iterations = 40;
  options.function_tolerance = 1e-8;
  options.num_threads = settings.threads;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable()) return std::nullopt;
  for (std::size_t c = 0; c < rig.size(); ++c) {
    CameraFromWorld& pose = refined.rig[c].camera_from_world;
    ceres::AngleAxisToRotationMatrix(poses[c].data(), pose.rotation.data());
    std::copy_n(poses[c].data() + 3, 3, pose.translation.data());
  }
  refined.after_px = robust_rms_px(refined.rig, markers, points);
  return refined;
}

}  // namespace mocap::calibration
