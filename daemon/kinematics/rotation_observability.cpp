#include "kinematics/rotation_observability.h"

#include <Eigen/Eigenvalues>

#include "kinematics/pose_fit.h"
#include "kinematics/rotation.h"

namespace mocap::kinematics {
namespace {

// Standard deviation of a marker that several cameras detect well, of a joint that nothing observes, and the largest
// one of a rotation that counts as observable. Chosen by hand; not yet measured.
constexpr double kMeasurementSigma_m = 0.001;
constexpr double kUninformativeSigma_rad = 3.0;
constexpr double kMaxObservableSigma_rad = 0.2;

}  // namespace

std::vector<bool> rotation_observability(const MarkerSet& set) {
  PoseFit pose(set, PoseFit::Lengths::Fixed);
  std::vector<Pose> middle(pose.locals().begin(), pose.locals().end());
  const auto& bones = set.skeleton.bones;
  for (std::size_t b = 1; b < bones.size(); ++b) {
    Eigen::Vector3d rotation = Eigen::Vector3d::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      const auto& range = bones[b].rotation_limits[static_cast<std::size_t>(axis)];
      if (range) rotation[axis] = 0.5 * (range->min_rad + range->max_rad);
    }
    middle[b].rotation = from_rotation_vector(rotation);
  }
  pose.set_locals(middle);
  std::vector<Observation> seen;
  for (std::size_t m = 0; m < set.markers.size(); ++m) {
    seen.push_back({static_cast<int>(m), pose.marker_at(m), kMeasurementSigma_m});
  }
  std::vector<bool> observable(bones.size(), false);
  if (!pose.compute_covariances(seen, {.rest_sigma_rad = kUninformativeSigma_rad})) return observable;
  for (std::size_t b = 0; b < bones.size(); ++b) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spread(pose.rotation_covariance(b), Eigen::EigenvaluesOnly);
    observable[b] = spread.eigenvalues()[2] < kMaxObservableSigma_rad * kMaxObservableSigma_rad;
  }
  return observable;
}

}  // namespace mocap::kinematics
