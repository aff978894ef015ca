#include "calibration/rig/rig_evidence.h"

#include <Eigen/Dense>
#include "calibration/wand/solution_quality.h"

namespace mocap::calibration {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// z: the normal of the plane that fits the camera centres best, against the mean viewing direction. Most cameras are at
// one height and look down.
Pose upright_world(const Rig& rig) {
  Vector3d mean = Vector3d::Zero();
  Vector3d optical_axes = Vector3d::Zero();
  for (const CameraModel& camera : rig) {
    mean += camera.centre().v / static_cast<double>(rig.size());
    optical_axes += camera.camera_from_world.rotation.row(2).transpose();
  }
  Matrix3d scatter = Matrix3d::Zero();
  for (const CameraModel& camera : rig) {
    const Vector3d arm = camera.centre().v - mean;
    scatter += arm * arm.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(scatter);
  Matrix3d axes;
  axes.row(2) = eigen.eigenvectors().col(0).transpose();
  if (axes.row(2).dot(optical_axes) > 0.0) axes.row(2) *= -1.0;
  axes.row(0) = eigen.eigenvectors().col(2).transpose();
  axes.row(1) = axes.row(2).cross(axes.row(0));
  return {-(axes * mean), Eigen::Quaterniond(axes).normalized()};
}

}  // namespace

RigEvidence evidence_of(const WandSolution& solution, const std::optional<Floor>& floor) {
  const Bundle& bundle = solution.bundle;
  const Pose world_from_rig = floor ? floor->world_from_rig : upright_world(bundle.rig);
  RigEvidence evidence;
  evidence.rig = in_world({world_from_rig, 0.0}, bundle.rig);
  evidence.residuals = solution.residuals;
  evidence.lengths_m = triangulated_lengths_m(bundle);
  evidence.nominal_length_m = bundle.wand.length_m();
  evidence.floor_is_measured = floor.has_value();
  for (std::size_t c = 0; c < solution.cameras.size(); ++c) {
    if (!solution.cameras[c].synchronisation_checked) evidence.unsynchronised.push_back(bundle.rig[c].name);
  }
  std::vector<bool> used(bundle.wand_poses.size(), false);
  for (const Observation& observation : bundle.observations)
    used[static_cast<std::size_t>(observation.wand_pose)] = true;
  for (std::size_t p = 0; p < bundle.wand_poses.size(); ++p) {
    if (used[p]) evidence.points_m.emplace_back(world_from_rig * bundle.wand_poses[p].middle_m);
  }
  // Rotates each 3 x 3 block into world axes.
  const Matrix3d rotation = world_from_rig.rotation.toRotationMatrix();
  evidence.covariance = solution.covariance;
  for (Eigen::Index i = 0; i < evidence.covariance.rows(); i += 3) {
    for (Eigen::Index j = 0; j < evidence.covariance.cols(); j += 3) {
      evidence.covariance.block<3, 3>(i, j) = rotation * solution.covariance.block<3, 3>(i, j) * rotation.transpose();
    }
  }
  return evidence;
}

}  // namespace mocap::calibration
