#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "calibration/wand/wand.h"
#include "model/points.h"
#include "model/transform.h"

namespace mocap::calibration {

/// From one camera's frame to another's.
using Between = RigidTransform<CameraPoint, CameraPoint>;

/// The wand as one camera saw it: its markers on the plane z = 1, distortion undone.
struct WandRays {
  std::array<Eigen::Vector2d, kMostMarks> ray{};
  bool either_way = false;  ///< nobody knows yet which end is the first
};

/// The wand in two pictures of one instant.
struct WandPair {
  WandRays a;
  WandRays b;
};

/// How two cameras stand to each other.
struct Relation {
  Between b_from_a;        ///< m
  int agreeing = 0;        ///< pairs that agree
  double share = 0.0;      ///< of all
  double angle_rad = 0.0;  ///< median angle between the rays
};

/// Relates two cameras by the essential matrix of what both saw of a wand, and its length. `reach`: how far a ray may
/// lie from its epipolar line, on the plane z = 1. Nothing where fewer than 8 pairs agree, or where these do not tell.
///
/// Sources: Nister, "An efficient solution to the five-point relative pose problem" (2004); Fischler, Bolles, "Random
/// sample consensus" (1981).
std::optional<Relation> relate(const std::vector<WandPair>& pairs, const Wand& wand, double reach);

/// The middle of two rays where they pass each other, in a's frame; nothing behind a camera or for like rays.
std::optional<Eigen::Vector3d> meet(const Between& b_from_a, const Eigen::Vector2d& a, const Eigen::Vector2d& b);

}  // namespace mocap::calibration
