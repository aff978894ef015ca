#include "pose/swivel_plane_prior.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace mocap::pose {
namespace {

// A hinge's range on the wrong side is at most this share of that on the right one; so is that across, rad.
constexpr double kOneWay = 0.15;
constexpr double kAcross_rad = 0.3;
// What was seen is forgotten with this time constant, so that wrong names are.
constexpr double kForget_s = 6.0;
constexpr double kTold = 0.8;
// A plane is known when the joint was told for so long and was bent by so much, rms.
constexpr double kKnown_s = 0.5;
constexpr double kBent_rad = 0.25;
// Nobody's joint strays by less; at first it is thought to stray so far, which counts for so long.
constexpr double kLeastStray_rad = 0.03;
constexpr double kFirstStray_rad = 0.15;
constexpr double kFirst_s = 0.1;
// Planes change slowly.
constexpr double kTellEvery_s = 0.1;

}  // namespace

BendingPlanes::BendingPlanes(const Skeleton& skeleton) : hinges_(skeleton.bones.size()) {
  for (std::size_t b = 1; b < skeleton.bones.size(); ++b) {
    const auto& turns = skeleton.bones[b].turns;
    if (!turns[0] || !turns[1] || !turns[2]) continue;
    int bends = -1, across = -1;
    for (int axis = 0; axis < 3; ++axis) {
      const AngleRange& range = *turns[static_cast<std::size_t>(axis)];
      const double up = std::max(0.0, range.max_rad), down = std::max(0.0, -range.min_rad);
      if (std::max(up, down) < kAcross_rad) {
        across = axis;
      } else if (std::min(up, down) <= kOneWay * std::max(up, down)) {
        bends = axis;
      }
    }
    if (bends < 0 || across < 0) continue;
    hinges_[b].along = 3 - bends - across;
    hinges_[b].bends = bends;
    hinges_[b].across = across;
  }
}

void BendingPlanes::reset() {
  for (Hinge& hinge : hinges_) {
    hinge.told_s = hinge.since_s = 0.0;
    hinge.swung.setZero();
    hinge.plane = {};
  }
}

void BendingPlanes::learn(std::size_t bone, const Eigen::Quaterniond& local, const Eigen::Matrix3d& share,
                          double step_s) {
  Hinge& hinge = hinges_[bone];
  if (hinge.along < 0 || !(step_s > 0.0)) return;
  if (!(share(hinge.bends, hinge.bends) > kTold && share(hinge.across, hinge.across) > kTold)) return;
  const Eigen::Vector3d tip = local * Eigen::Vector3d::Unit(hinge.along);
  const Eigen::Vector2d swung(tip[hinge.bends], tip[hinge.across]);
  const double left = std::exp(-step_s / kForget_s);
  hinge.told_s = left * hinge.told_s + step_s;
  hinge.swung = left * hinge.swung + step_s * swung * swung.transpose();
  hinge.since_s += step_s;
  if (hinge.since_s < kTellEvery_s || hinge.told_s < kKnown_s) return;
  hinge.since_s = 0.0;
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes;
  axes.computeDirect(hinge.swung);
  const double bent2 = axes.eigenvalues()[1] / hinge.told_s;
  if (!(bent2 > kBent_rad * kBent_rad)) return;
  const double strayed2 = std::max(0.0, axes.eigenvalues()[0]) + kFirst_s * kFirstStray_rad * kFirstStray_rad;
  const double stray2 = std::max(kLeastStray_rad * kLeastStray_rad, strayed2 / (hinge.told_s + kFirst_s));
  hinge.plane.along = Eigen::Vector3d::Unit(hinge.along);
  hinge.plane.across.setZero();
  hinge.plane.across[hinge.bends] = axes.eigenvectors()(0, 0);
  hinge.plane.across[hinge.across] = axes.eigenvectors()(1, 0);
  hinge.plane.weight_1_rad2 = 1.0 / stray2;
}

}  // namespace mocap::pose
