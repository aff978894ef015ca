#pragma once

#include <Eigen/Core>
#include <bitset>
#include <span>
#include <vector>

#include "base/archive.h"

namespace mocap::pose {

/// Bound on the points of one search; further points are ignored.
inline constexpr std::size_t kMaxCloudPoints = 192;

using UsedPoints = std::bitset<kMaxCloudPoints>;

/// Points of one instant with their mutual distances. Allocates in the constructor only.
class PointCloud {
 public:
  PointCloud();

  /// Takes over the first kMaxCloudPoints points.
  void assign(std::span<const Eigen::Vector3d> points);

  /// Writes the points, or takes them over from another cloud (see Archive).
  void archive(Archive& members);

  std::size_t size() const noexcept { return points_.size(); }
  const Eigen::Vector3d& operator[](std::size_t i) const { return points_[i]; }
  double distance(std::size_t i, std::size_t j) const { return distances_[i * points_.size() + j]; }

 private:
  void compute_distances();

  std::vector<Eigen::Vector3d> points_;
  std::vector<float> distances_;
};

}  // namespace mocap::pose
