#include "calibration/bundle_problem.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <algorithm>
#include <cmath>

#include "calibration/distort_ray.h"

namespace mocap::calibration {
namespace {

/// Reprojection residual of one wand marker, in units of its standard deviation.
struct Reprojection {
  LensKind kind;
  double offset_m;  // of the marker from the wand's middle, along the wand
  Eigen::Vector2d px;
  double sigma_px;

  template <class T>
  bool operator()(const T* pose, const T* intrinsics, const T* wand_pose, T* residual) const {
    const T point[3] = {wand_pose[0] + offset_m * wand_pose[3], wand_pose[1] + offset_m * wand_pose[4],
                        wand_pose[2] + offset_m * wand_pose[5]};
    T in_camera[3];
    ceres::AngleAxisRotatePoint(pose, point, in_camera);
    for (int i = 0; i < 3; ++i) in_camera[i] += pose[3 + i];
    const T depth = in_camera[2] < kMinDepth_m ? T(kMinDepth_m) : in_camera[2];
    T at[2];
    distort_ray<T>(kind, intrinsics, in_camera[0] / depth, in_camera[1] / depth, at);
    residual[0] = (at[0] - px.x()) / sigma_px;
    residual[1] = (at[1] - px.y()) / sigma_px;
    return true;
  }
};

/// Gaussian prior of the intrinsics, about their initial values. It keeps parameters finite that the observations do
/// not determine.
struct IntrinsicsPrior {
  std::array<double, BundleProblem::kIntrinsicsSize> mean;
  std::array<double, BundleProblem::kIntrinsicsSize> sigma;

  template <class T>
  bool operator()(const T* intrinsics, T* residual) const {
    for (std::size_t i = 0; i < mean.size(); ++i) residual[i] = (intrinsics[i] - mean[i]) / sigma[i];
    return true;
  }
};

// Focal lengths to 20 %, the principal point to 5 % of the image width, distortion coefficients to 0.3 (tangential ones
// to 0.01). Chosen by hand; wide against what the observations determine.
IntrinsicsPrior prior_of(const CameraModel& camera, const std::array<double, BundleProblem::kIntrinsicsSize>& start) {
  const double half = 0.05 * camera.width_px;
  IntrinsicsPrior prior{start, {0.2 * start[0], 0.2 * start[1], half, half, 0.3, 0.3, 0.01, 0.01, 0.3}};
  if (camera.lens.kind == LensKind::Fisheye) prior.sigma[6] = prior.sigma[7] = 0.3;
  return prior;
}

}  // namespace

std::vector<int> free_intrinsic_indices(FreeIntrinsics free_intrinsics, LensKind kind) {
  switch (free_intrinsics) {
    case FreeIntrinsics::None: return {};
    case FreeIntrinsics::FocalLengths: return {0, 1};
    case FreeIntrinsics::FocalLengthsAndK1: return {0, 1, 4};
    case FreeIntrinsics::All: break;
  }
  if (kind == LensKind::Fisheye) return {0, 1, 2, 3, 4, 5, 6, 7};
  return {0, 1, 2, 3, 4, 5, 6, 7, 8};
}

BundleProblem::BundleProblem(const Bundle& bundle, const BundleSettings& settings)
    : poses_(bundle.rig.size()),
      intrinsics_(bundle.rig.size()),
      wand_poses_(bundle.wand_poses.size()),
      has_camera_(bundle.rig.size()),
      has_wand_pose_(bundle.wand_poses.size()),
      problem_(std::make_unique<ceres::Problem>()) {
  for (std::size_t c = 0; c < poses_.size(); ++c) {
    const CameraModel& camera = bundle.rig[c];
    ceres::RotationMatrixToAngleAxis(camera.camera_from_world.rotation.data(), poses_[c].data());
    std::copy_n(camera.camera_from_world.translation.data(), 3, poses_[c].data() + 3);
    intrinsics_[c] = {camera.lens.fx_px, camera.lens.fy_px, camera.lens.cx_px, camera.lens.cy_px};
    std::copy_n(camera.lens.distortion.data(), 5, intrinsics_[c].data() + 4);
  }
  for (std::size_t p = 0; p < wand_poses_.size(); ++p) {
    std::copy_n(bundle.wand_poses[p].middle_m.data(), 3, wand_poses_[p].data());
    std::copy_n(bundle.wand_poses[p].direction.data(), 3, wand_poses_[p].data() + 3);
  }
  ceres::LossFunction* const loss =
      settings.loss_scale_sigmas > 0.0 ? new ceres::CauchyLoss(settings.loss_scale_sigmas) : nullptr;
  for (const Observation& observation : bundle.observations) {
    const auto c = static_cast<std::size_t>(observation.camera);
    const auto p = static_cast<std::size_t>(observation.wand_pose);
    auto* const error =
        new Reprojection{bundle.rig[c].lens.kind,
                         bundle.wand.marks_m[static_cast<std::size_t>(observation.marker)] - bundle.wand.middle_m(),
                         observation.px, observation.sigma_px};
    problem_->AddResidualBlock(
        new ceres::AutoDiffCostFunction<Reprojection, 2, kPoseSize, kIntrinsicsSize, kWandPoseSize>(error), loss,
        pose(c), intrinsics(c), wand_pose(p));
    has_camera_[c] = true;
    has_wand_pose_[p] = true;
  }
  if (bundle.observations.empty()) delete loss;  // else the problem owns it
  for (std::size_t c = 0; c < poses_.size(); ++c) {
    const bool constant = settings.fix_cameras || (settings.fix_first_camera && c == 0);
    if (constant && has_camera_[c]) problem_->SetParameterBlockConstant(pose(c));
  }
  set_free_intrinsics(bundle, settings.fix_cameras ? FreeIntrinsics::None : settings.free_intrinsics);
  for (std::size_t p = 0; p < wand_poses_.size(); ++p) {
    if (!has_wand_pose_[p]) continue;
    problem_->SetManifold(wand_pose(p),
                          new ceres::ProductManifold<ceres::EuclideanManifold<3>, ceres::SphereManifold<3>>());
  }
}

BundleProblem::~BundleProblem() = default;

void BundleProblem::set_free_intrinsics(const Bundle& bundle, FreeIntrinsics free_intrinsics) {
  for (std::size_t c = 0; c < intrinsics_.size(); ++c) {
    if (!has_camera_[c]) continue;
    const std::vector<int> free =
        free_intrinsic_indices(bundle.free_intrinsics(c, free_intrinsics), bundle.rig[c].lens.kind);
    if (free.empty()) {
      problem_->SetParameterBlockConstant(intrinsics(c));
      continue;
    }
    if (free.size() < kIntrinsicsSize) {
      std::vector<int> constant;
      for (int i = 0; i < kIntrinsicsSize; ++i) {
        if (std::ranges::find(free, i) == free.end()) constant.push_back(i);
      }
      problem_->SetManifold(intrinsics(c), new ceres::SubsetManifold(kIntrinsicsSize, constant));
    }
    problem_->AddResidualBlock(new ceres::AutoDiffCostFunction<IntrinsicsPrior, kIntrinsicsSize, kIntrinsicsSize>(
                                   new IntrinsicsPrior(prior_of(bundle.rig[c], intrinsics_[c]))),
                               nullptr, intrinsics(c));
  }
}

std::shared_ptr<ceres::OrderedGroups<double*>> BundleProblem::elimination_order() {
  auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
  for (std::size_t p = 0; p < wand_poses_.size(); ++p) {
    if (has_wand_pose_[p]) ordering->AddElementToGroup(wand_pose(p), 0);
  }
  for (std::size_t c = 0; c < poses_.size(); ++c) {
    if (!has_camera_[c]) continue;
    ordering->AddElementToGroup(pose(c), 1);
    ordering->AddElementToGroup(intrinsics(c), 1);
  }
  return ordering;
}

void BundleProblem::write_back(Bundle& bundle) const {
  for (std::size_t c = 0; c < poses_.size(); ++c) {
    CameraModel& camera = bundle.rig[c];
    ceres::AngleAxisToRotationMatrix(poses_[c].data(), camera.camera_from_world.rotation.data());
    std::copy_n(poses_[c].data() + 3, 3, camera.camera_from_world.translation.data());
    camera.lens.fx_px = intrinsics_[c][0];
    camera.lens.fy_px = intrinsics_[c][1];
    camera.lens.cx_px = intrinsics_[c][2];
    camera.lens.cy_px = intrinsics_[c][3];
    std::copy_n(intrinsics_[c].data() + 4, 5, camera.lens.distortion.data());
  }
  for (std::size_t p = 0; p < wand_poses_.size(); ++p) {
    std::copy_n(wand_poses_[p].data(), 3, bundle.wand_poses[p].middle_m.data());
    std::copy_n(wand_poses_[p].data() + 3, 3, bundle.wand_poses[p].direction.data());
    bundle.wand_poses[p].direction.normalize();
  }
}

}  // namespace mocap::calibration
