#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "model/points.h"
#include "model/transform.h"

namespace mocap::geometry {

/// The positions of one point in two frames.
struct PointPair {
  Eigen::Vector3d from;
  Eigen::Vector3d to;
  double weight = 1.0;  ///< 0 or more
};

struct RigidFit {
  Pose to_from;
  double rms_m = 0.0;  ///< weighted rms distance of `to` from the transformed `from`
};

/// The rotation and translation, never a reflection, that map `from` to `to` with the least weighted sum of squares.
///
/// Nothing for fewer than three points with a weight above 0, or if these points lie on one line (second singular value
/// below 1e-6 of the first) or coincide. Never allocates.
///
/// Source: Kabsch, "A discussion of the solution for the best rotation to relate two sets of vectors" (1978).
std::optional<RigidFit> fit_rigid(std::span<const PointPair> pairs);

/// A rotation about the vertical, a scale and a translation: maps a template to a person who stands upright.
struct UprightFit {
  double yaw_rad = 0.0;
  double scale = 1.0;
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  double rms_m = 0.0;

  Eigen::Vector3d operator*(const Eigen::Vector3d& from) const;
};

/// The upright similarity that maps `from` to `to` with the least weighted sum of squares. Nothing for fewer than two
/// points with a weight above 0, or if these points lie on one vertical line. Never allocates.
std::optional<UprightFit> fit_upright(std::span<const PointPair> pairs);

}  // namespace mocap::geometry
