#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "geometry/rigid_fit.h"
#include "identify/tpose_finder.h"
#include "model/skeleton.h"

namespace mocap::identify {

/// Finds a rigid body (a set with one bone) in any pose by the distances between its markers. Three markers propose a
/// pose, the other markers confirm it: the first three, or those of the largest triangle if the first three lie on one
/// line within the tolerance. Nothing is found if two assignments fit about equally well. A mirror image does not fit,
/// unless all markers lie in one plane. A set of fewer than three markers is not found.
///
/// All markers must have a point, except one marker of a set of five or more. Allocates in the constructor only.
class RigidFinder {
 public:
  /// `tolerance_m`: largest rms distance of the points from the markers of the body. Single distances and points have
  /// gates of two and three times this value.
  RigidFinder(const MarkerSet& set, double tolerance_m);

  const std::optional<FoundBody>& find(std::span<const Eigen::Vector3d> points);

 private:
  void choose_triple();
  bool distance_matches(std::size_t a, std::size_t b, const Eigen::Vector3d& p, const Eigen::Vector3d& q) const;
  void evaluate_triple(std::span<const Eigen::Vector3d> points, std::size_t i, std::size_t j, std::size_t k);

  double tolerance_m_;
  std::vector<Eigen::Vector3d> model_;
  std::array<std::size_t, 3> triple_{0, 1, 2};  // markers that propose a pose
  FoundBody candidate_;
  std::vector<geometry::PointPair> pairs_;
  std::optional<FoundBody> found_;
  bool ambiguous_ = false;
};

}  // namespace mocap::identify
