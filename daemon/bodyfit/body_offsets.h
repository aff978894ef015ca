#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "base/archive.h"
#include "model/skeleton.h"
#include "model/transform.h"

namespace mocap::bodyfit {

/// The parameters of a body that a fit estimates: rest offsets of the bones and offsets of the markers.
struct BodyOffsets {
  std::vector<Eigen::Vector3d> bones_m;    ///< rest offset, by bone; that of the root is not used
  std::vector<Eigen::Vector3d> markers_m;  ///< in the frame of the marker's bone, by marker

  void archive(Archive& members) { members(bones_m, markers_m); }
};

/// The offsets of a marker set.
BodyOffsets offsets_of(const MarkerSet& set);
/// Replaces the offsets of a marker set. `offsets` has the same bones and markers.
void apply_offsets(const BodyOffsets& offsets, MarkerSet& set);

/// One instant of one body: measured marker positions and an estimated pose.
struct BodyInstant {
  std::vector<Eigen::Vector3d> seen_m;  ///< by marker, in the world frame; not finite: not measured
  std::vector<double> trust;            ///< by marker, 0 to 1: nominal variance divided by the marker's variance
  std::vector<Pose> locals;             ///< by bone: the pose; positions other than the root's are not used
  std::vector<std::uint8_t> at_rest;    ///< by bone: 1 if the joint is in rest pose (the root: upright), else 0

  void archive(Archive& members) { members(seen_m, trust, locals, at_rest); }
};

/// An instant without measurements, in rest pose.
BodyInstant empty_instant(const MarkerSet& set);

/// Difference of two local poses of one body: sum over the joints of the squared sine of half the angle between their
/// rotations. A body of one bone has no joints. Its orientation counts, because other orientations have other camera
/// errors.
double pose_distance(std::span<const Pose> one, std::span<const Pose> other);

/// Standard deviations that define the cost of a pose.
struct InstantCost {
  double sigma_m = 0.003;  ///< of a measured marker from its position on the body
  /// Variance of the displacement that all markers of a bone have in common, in units of sigma_m^2: skin moves as a
  /// whole. Not for a bone with one marker, where sigma_m has both. Rigid motion is most of the soft tissue artefact
  /// (Dumas et al., "What portion of the soft tissue artefact requires compensation when estimating joint
  /// kinematics?", J. Biomech. Eng. 2014).
  double common_variance = 1.0;
  double outlier_m = 0.03;           ///< scale of the robust cost: a marker farther off has little weight
  double rest_sigma_rad = 3.0;       ///< of a joint from rest pose
  double at_rest_sigma_rad = 0.02;   ///< the same for a joint with `at_rest`
  double upright_sigma_rad = 0.035;  ///< of the tilt of a root with `at_rest`
  double limit_sigma_rad = 0.2;      ///< of a joint beyond its range

  void archive(Archive& members) {
    members(sigma_m, common_variance, outlier_m, rest_sigma_rad, at_rest_sigma_rad, upright_sigma_rad, limit_sigma_rad);
  }
};

}  // namespace mocap::bodyfit
