#include "pose/swivel_plane_prior.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace mocap::pose {
namespace {

// A hinge's range on the wrong side is at most this share of that on the right one; so is that across, rad.
constexpr double kMaxReverseRangeFraction = 0.15;
constexpr double kMaxMinorRange_rad = 0.3;
// What was seen is forgotten with this time constant, so that wrong names are.
constexpr double kPlaneForgetting_s = 6.0;
constexpr double kMinObservedFraction = 0.8;
// A plane is known when the joint was told for so long and was bent by so much, rms.
constexpr double kMinObserved_s = 0.5;
constexpr double kMinBend_rad = 0.25;
// Nobody's joint strays by less; at first it is thought to stray so far, which counts for so long.
constexpr double kMinPlaneSigma_rad = 0.03;
constexpr double kInitialPlaneSigma_rad = 0.15;
constexpr double kInitialWeight_s = 0.1;
// Planes change slowly.
constexpr double kUpdateInterval_s = 0.1;

}  // namespace

SwivelPlanePrior::SwivelPlanePrior(const Skeleton& skeleton) : hinges_(skeleton.bones.size()) {
  for (std::size_t b = 1; b < skeleton.bones.size(); ++b) {
    const auto& turns = skeleton.bones[b].turns;
    if (!turns[0] || !turns[1] || !turns[2]) continue;
    int hinge_axis = -1, minor_axis = -1;
    for (int axis = 0; axis < 3; ++axis) {
      const AngleRange& range = *turns[static_cast<std::size_t>(axis)];
      const double up = std::max(0.0, range.max_rad), down = std::max(0.0, -range.min_rad);
      if (std::max(up, down) < kMaxMinorRange_rad) {
        minor_axis = axis;
      } else if (std::min(up, down) <= kMaxReverseRangeFraction * std::max(up, down)) {
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
  if (!(observed_fraction(hinge.hinge_axis, hinge.hinge_axis) > kMinObservedFraction &&
        observed_fraction(hinge.minor_axis, hinge.minor_axis) > kMinObservedFraction))
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
