#include "pose/point_cloud.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace mocap::pose {
namespace point_cloud_test {

using Eigen::Vector3d;

std::vector<Vector3d> random_points(std::size_t count) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> flat(-2.0, 2.0);
  std::vector<Vector3d> points;
  for (std::size_t i = 0; i < count; ++i) points.emplace_back(flat(random), flat(random), flat(random));
  return points;
}

// m: rounding of distances of a few metres to single precision.
constexpr double kRounding_m = 1e-6;

TEST(PointCloud, KnowsTheDistanceOfEachPairOfPoints) {
  const std::vector<Vector3d> points = random_points(40);
  PointCloud cloud;

  cloud.assign(points);

  ASSERT_EQ(cloud.size(), points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(cloud[i], points[i]);
    for (std::size_t j = 0; j < points.size(); ++j) {
      EXPECT_NEAR(cloud.distance(i, j), (points[i] - points[j]).norm(), kRounding_m);
    }
  }
}

TEST(PointCloud, ForgetsThePointsOfTheInstantBefore) {
  const std::vector<Vector3d> points = random_points(40);
  PointCloud cloud;
  cloud.assign(points);

  cloud.assign(std::span(points).last(3));

  ASSERT_EQ(cloud.size(), 3U);
  EXPECT_NEAR(cloud.distance(0, 2), (points[37] - points[39]).norm(), kRounding_m);
  cloud.assign({});
  EXPECT_EQ(cloud.size(), 0U);
}

TEST(PointCloud, IgnoresPointsBeyondItsBound) {
  const std::vector<Vector3d> points = random_points(kMaxCloudPoints + 5);
  PointCloud cloud;

  cloud.assign(points);

  ASSERT_EQ(cloud.size(), kMaxCloudPoints);
  EXPECT_EQ(cloud[kMaxCloudPoints - 1], points[kMaxCloudPoints - 1]);
}

}  // namespace point_cloud_test
}  // namespace mocap::pose
