#include "kinematics/rotation_observability.h"

#include <Eigen/Eigenvalues>

#include "kinematics/pose_fit.h"
#include "kinematics/rotation.h"

namespace mocap::kinematics {
namespace {

// A marker that cameras see well; what is then left of a joint that nothing else is known of, but for this.
constexpr double kSeen_m = 0.001;
constexpr double kUnknown_rad = 3.0;
constexpr double kTold_rad = 0.2;

}  // namespace

std::vector<bool> turns_told(const MarkerSet& set) {
  PoseFit pose(set, PoseFit::Lengths::Fixed);
  std::vector<Pose> middle(pose.locals().begin(), pose.locals().end());
  const auto& bones = set.skeleton.bones;
  for (std::size_t b = 1; b < bones.size(); ++b) {
    Eigen::Vector3d turn = Eigen::Vector3d::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      const auto& range = bones[b].turns[static_cast<std::size_t>(axis)];
      if (range) turn[axis] = 0.5 * (range->min_rad + range->max_rad);
    }
    middle[b].rotation = turn_by(turn);
  }
  pose.set_locals(middle);
  std::vector<Observation> seen;
  for (std::size_t m = 0; m < set.markers.size(); ++m) {
    seen.push_back({static_cast<int>(m), pose.marker_at(m), kSeen_m});
  }
  std::vector<bool> told(bones.size(), false);
  if (!pose.weigh(seen, {.rest_sigma_rad = kUnknown_rad})) return told;
  for (std::size_t b = 0; b < bones.size(); ++b) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spread(pose.turn_covariance(b), Eigen::EigenvaluesOnly);
    told[b] = spread.eigenvalues()[2] < kTold_rad * kTold_rad;
  }
  return told;
}

}  // namespace mocap::kinematics
