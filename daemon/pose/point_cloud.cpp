#include "pose/point_cloud.h"

#include <algorithm>

namespace mocap::pose {

PointCloud::PointCloud() {
  points_.reserve(kMaxCloudPoints);
  distances_.reserve(kMaxCloudPoints * kMaxCloudPoints);
}

void PointCloud::assign(std::span<const Eigen::Vector3d> points) {
  points = points.first(std::min(points.size(), kMaxCloudPoints));
  points_.assign(points.begin(), points.end());
  compute_distances();
}

void PointCloud::archive(Archive& members) {
  if (members.is_reading()) points_.clear();
  members(points_);
  if (members.is_reading()) compute_distances();
}

void PointCloud::compute_distances() {
  distances_.resize(points_.size() * points_.size());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    for (std::size_t j = 0; j < points_.size(); ++j) {
      distances_[i * points_.size() + j] = static_cast<float>((points_[i] - points_[j]).norm());
    }
  }
}

}  // namespace mocap::pose
