#pragma once

#include <Eigen/Core>
#include <bitset>
#include <span>
#include <vector>

namespace mocap::pose {

/// More points are not looked at in one search.
inline constexpr std::size_t kMostCloudPoints = 192;

using PointsTaken = std::bitset<kMostCloudPoints>;

/// Points of one instant and how far they are apart. Allocates in the constructor only.
class BodyCloud {
 public:
  BodyCloud();

  /// The first kMostCloudPoints of them.
  void take(std::span<const Eigen::Vector3d> points);

  std::size_t size() const noexcept { return points_.size(); }
  const Eigen::Vector3d& operator[](std::size_t i) const { return points_[i]; }
  double apart(std::size_t i, std::size_t j) const { return apart_[i * points_.size() + j]; }

 private:
  std::vector<Eigen::Vector3d> points_;
  std::vector<float> apart_;
};

}  // namespace mocap::pose
