#pragma once

#include <Eigen/Core>
#include <bitset>
#include <span>
#include <vector>

namespace mocap::pose {

/// More points are not looked at in one search.
inline constexpr std::size_t kMaxCloudPoints = 192;

using UsedPoints = std::bitset<kMaxCloudPoints>;

/// Points of one instant and how far they are apart. Allocates in the constructor only.
class PointCloud {
 public:
  PointCloud();

  /// The first kMaxCloudPoints of them.
  void assign(std::span<const Eigen::Vector3d> points);

  std::size_t size() const noexcept { return points_.size(); }
  const Eigen::Vector3d& operator[](std::size_t i) const { return points_[i]; }
  double distance(std::size_t i, std::size_t j) const { return distances_[i * points_.size() + j]; }

 private:
  std::vector<Eigen::Vector3d> points_;
  std::vector<float> distances_;
};

}  // namespace mocap::pose
