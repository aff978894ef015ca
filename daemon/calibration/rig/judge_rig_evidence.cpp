#include <Eigen/Dense>
#include <cmath>

#include "calibration/rig/judge_rig.h"
#include "calibration/wand/rate_wand.h"

namespace mocap::calibration {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Cameras hang at about one height and look down: upright is across the plane that they are in.
Pose about_upright(const Rig& rig) {
  Vector3d middle = Vector3d::Zero();
  Vector3d look = Vector3d::Zero();
  for (const CameraModel& camera : rig) {
    middle += camera.centre().v / static_cast<double>(rig.size());
    look += camera.camera_from_world.rotation.row(2).transpose();
  }
  Matrix3d spread = Matrix3d::Zero();
  for (const CameraModel& camera : rig) {
    const Vector3d arm = camera.centre().v - middle;
    spread += arm * arm.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(spread);
  Matrix3d axes;
  axes.row(2) = eigen.eigenvectors().col(0).transpose();
  if (axes.row(2).dot(look) > 0.0) axes.row(2) *= -1.0;
  axes.row(0) = eigen.eigenvectors().col(2).transpose();
  axes.row(1) = axes.row(2).cross(axes.row(0));
  return {-(axes * middle), Eigen::Quaterniond(axes).normalized()};
}

}  // namespace

RigEvidence evidence_of(const WandSolution& solution, const std::optional<Floor>& floor) {
  const Bundle& bundle = solution.bundle;
  const Pose world_from_rig = floor ? floor->world_from_rig : about_upright(bundle.rig);
  RigEvidence evidence;
  evidence.rig = laid_on({world_from_rig, 0.0}, bundle.rig);
  evidence.residuals = solution.residuals;
  evidence.lengths_m = wand_lengths_m(bundle);
  evidence.told_length_m = bundle.wand.length_m();
  if (floor) evidence.floor_rms_m = floor->rms_m;
  std::vector<bool> used(bundle.places.size(), false);
  for (const Sight& sight : bundle.sights) used[static_cast<std::size_t>(sight.place)] = true;
  for (std::size_t p = 0; p < bundle.places.size(); ++p) {
    if (used[p]) evidence.points_m.emplace_back(world_from_rig * bundle.places[p].middle_m);
  }
  // Three by three, in the world's axes.
  const Matrix3d turn = world_from_rig.rotation.toRotationMatrix();
  evidence.covariance = solution.covariance;
  for (Eigen::Index i = 0; i < evidence.covariance.rows(); i += 3) {
    for (Eigen::Index j = 0; j < evidence.covariance.cols(); j += 3) {
      evidence.covariance.block<3, 3>(i, j) = turn * solution.covariance.block<3, 3>(i, j) * turn.transpose();
    }
  }
  return evidence;
}

}  // namespace mocap::calibration
