#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "geometry/rigid_fit.h"
#include "identify/tpose_finder.h"
#include "model/skeleton.h"

namespace mocap::identify {

/// Finds a thing of one bone among points by the distances of its markers, in any pose: three markers propose, the
/// others decide. Its mirror image is refused, as is what can be read in two ways.
///
/// All markers must be there, save one of five or more. Allocates in the constructor only.
class RigidFinder {
 public:
  /// `tolerance_m`: how far a marker may be from where the body puts it.
  RigidFinder(const MarkerSet& set, double tolerance_m);

  const std::optional<FoundBody>& find(std::span<const Eigen::Vector3d> points);

 private:
  bool distance_matches(int a, int b, const Eigen::Vector3d& p, const Eigen::Vector3d& q) const;
  void evaluate_triple(std::span<const Eigen::Vector3d> points, std::size_t i, std::size_t j, std::size_t k);

  double tolerance_m_;
  std::vector<Eigen::Vector3d> model_;
  FoundBody candidate_;
  std::vector<geometry::PointPair> pairs_;
  std::optional<FoundBody> found_;
  bool ambiguous_ = false;
};

}  // namespace mocap::identify
