#include "pose/swivel_plane_prior.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "kinematics/hinge_range.h"

namespace mocap::pose {
namespace {

// Time constant of exponential forgetting, so that observations with wrong labels fade. Chosen by hand; not yet
// measured.
constexpr double kPlaneForgetting_s = 6.0;
// A plane is known after this observed time with at least this rms bend. Chosen by hand; not yet measured.
constexpr double kMinObserved_s = 0.5;
constexpr double kMinBend_rad = 0.25;
// Smallest standard deviation of a bone from its plane, and the prior standard deviation with its weight in time.
// Chosen by hand; not yet measured.
constexpr double kMinPlaneSigma_rad = 0.03;
constexpr double kInitialPlaneSigma_rad = 0.15;
constexpr double kInitialWeight_s = 0.1;
// Time between two computations of a plane; planes change slowly.
constexpr double kUpdateInterval_s = 0.1;

}  // namespace

SwivelPlanePrior::SwivelPlanePrior(const Skeleton& skeleton) : hinges_(skeleton.bones.size()) {
  for (std::size_t b = 1; b < skeleton.bones.size(); ++b) {
    const auto& limits = skeleton.bones[b].rotation_limits;
    if (!limits[0] || !limits[1] || !limits[2]) continue;
    int hinge_axis = -1, minor_axis = -1;
    for (int axis = 0; axis < 3; ++axis) {
      const kinematics::AxisReach reach = kinematics::reach_of(*limits[static_cast<std::size_t>(axis)]);
      if (reach.larger_rad() < kinematics::kMaxMinorRange_rad) {
        minor_axis = axis;
      } else if (kinematics::bends_one_way(reach)) {
        hinge_axis = axis;
      }
    }
    if (hinge_axis < 0 || minor_axis < 0) continue;
    hinges_[b].bone_axis = 3 - hinge_axis - minor_axis;
    hinges_[b].hinge_axis = hinge_axis;
    hinges_[b].minor_axis = minor_axis;
  }
}

void SwivelPlanePrior::reset() {
  for (Hinge& hinge : hinges_) {
    hinge.observed_s = hinge.since_update_s = 0.0;
    hinge.tip_scatter.setZero();
    hinge.plane = {};
  }
}

void SwivelPlanePrior::update(std::size_t bone, const Eigen::Quaterniond& local,
                              const Eigen::Matrix3d& observed_fraction, double step_s) {
  Hinge& hinge = hinges_[bone];
  if (hinge.bone_axis < 0 || !(step_s > 0.0)) return;
  if (!(observed_fraction(hinge.hinge_axis, hinge.hinge_axis) > kinematics::kMinObservedFraction &&
        observed_fraction(hinge.minor_axis, hinge.minor_axis) > kinematics::kMinObservedFraction))
    return;
  const Eigen::Vector3d tip = local * Eigen::Vector3d::Unit(hinge.bone_axis);
  const Eigen::Vector2d tip_deviation(tip[hinge.hinge_axis], tip[hinge.minor_axis]);
  const double decay = std::exp(-step_s / kPlaneForgetting_s);
  hinge.observed_s = decay * hinge.observed_s + step_s;
  hinge.tip_scatter = decay * hinge.tip_scatter + step_s * tip_deviation * tip_deviation.transpose();
  hinge.since_update_s += step_s;
  if (hinge.since_update_s < kUpdateInterval_s || hinge.observed_s < kMinObserved_s) return;
  hinge.since_update_s = 0.0;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes;
  axes.computeDirect(hinge.tip_scatter);
  const double bend_variance_rad2 = axes.eigenvalues()[1] / hinge.observed_s;
  if (!(bend_variance_rad2 > kMinBend_rad * kMinBend_rad)) return;
  const double scatter_rad2_s =
      std::max(0.0, axes.eigenvalues()[0]) + kInitialWeight_s * kInitialPlaneSigma_rad * kInitialPlaneSigma_rad;
  const double plane_variance_rad2 =
      std::max(kMinPlaneSigma_rad * kMinPlaneSigma_rad, scatter_rad2_s / (hinge.observed_s + kInitialWeight_s));
  hinge.plane.bone_axis = Eigen::Vector3d::Unit(hinge.bone_axis);
  hinge.plane.normal.setZero();
  hinge.plane.normal[hinge.hinge_axis] = axes.eigenvectors()(0, 0);
  hinge.plane.normal[hinge.minor_axis] = axes.eigenvectors()(1, 0);
  hinge.plane.weight_1_rad2 = 1.0 / plane_variance_rad2;
}

}  // namespace mocap::pose
