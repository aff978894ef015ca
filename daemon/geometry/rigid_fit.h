#pragma once

#include <optional>
#include <span>

#include "model/points.h"
#include "model/transform.h"

namespace mocap::geometry {

/// Two places of one point, in two frames.
struct PointPair {
  Eigen::Vector3d from;
  Eigen::Vector3d to;
  double weight = 1.0;  ///< 0 or more
};

struct RigidFit {
  Pose to_from;
  double rms_m = 0.0;  ///< weighted, of `to` from where the pose puts `from`
};

/// The rotation and translation, never a mirror image, that bring `from` nearest to `to` by weighted least squares.
///
/// Nothing for fewer than three points of weight, or when they lie on one line (second singular value under 1e-6 of
/// the first, or everything in one place). Never allocates.
///
/// Source: Kabsch, "A discussion of the solution for the best rotation to relate two sets of vectors" (1978).
std::optional<RigidFit> fit_rigid(std::span<const PointPair> pairs);

/// A turn about the vertical, a scale and a translation: what a person who stands upright may differ by.
struct UprightFit {
  double yaw_rad = 0.0;
  double scale = 1.0;
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  double rms_m = 0.0;

  Eigen::Vector3d operator*(const Eigen::Vector3d& from) const;
};

/// The upright similarity that brings `from` nearest to `to` by weighted least squares. Nothing for fewer than two
/// points of weight, or when they stand in one vertical line or in one place. Never allocates.
std::optional<UprightFit> fit_upright(std::span<const PointPair> pairs);

}  // namespace mocap::geometry
