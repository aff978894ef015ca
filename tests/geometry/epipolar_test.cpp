#include "geometry/epipolar.h"

#include <gtest/gtest.h>

#include <opencv2/calib3d.hpp>
#include <random>
#include <vector>

#include "support/marker_world.h"

namespace mocap::geometry {
namespace epipolar_test {

using Eigen::Vector3d;
using test::camera_at;

NormalizedPoint seen(const CameraModel& camera, const Vector3d& point) {
  return {(camera.camera_from_world * WorldPoint{point}).v.hnormalized()};
}

TEST(EpipolarLine, ContainsTheProjectionInTheOtherCamera) {
  std::mt19937 random(1);
  const auto a = camera_at({4.0, 0.0, 2.5});
  const auto b = camera_at({1.0, 3.0, 2.0});
  const auto e = essential(a.camera_from_world, b.camera_from_world);
  for (const Vector3d& point : test::cloud(50, random)) {
    const EpipolarLine line = epipolar_line(e, seen(a, point));

    EXPECT_NEAR(line.distance(seen(b, point)), 0.0, 1e-12);
    NormalizedPoint off = seen(b, point);
    off.v += 0.01 * line.n.head<2>();
    EXPECT_NEAR(line.distance(off), 0.01, 1e-12);
  }
}

TEST(EpipolarLine, EqualsThatOfOpenCv) {
  std::mt19937 random(2);
  const auto a = camera_at({4.0, 0.0, 2.5});
  const auto b = camera_at({1.0, 3.0, 2.0});
  const Eigen::Matrix3d f = fundamental(a, b);
  cv::Matx33d reference_f;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) reference_f(i, j) = f(i, j);
  }
  for (const Vector3d& point : test::cloud(20, random)) {
    // Undistorted pixels: ray times focal length plus principal point.
    const auto pixel = [&](const CameraModel& c) {
      const auto ray = seen(c, point);
      return Eigen::Vector2d(ray.v.x() * c.lens.fx_px + c.lens.cx_px, ray.v.y() * c.lens.fy_px + c.lens.cy_px);
    };
    std::vector<cv::Vec3d> lines;
    cv::computeCorrespondEpilines(std::vector<cv::Point2d>{{pixel(a).x(), pixel(a).y()}}, 1, reference_f, lines);

    const double distance_px = lines[0][0] * pixel(b).x() + lines[0][1] * pixel(b).y() + lines[0][2];

    EXPECT_NEAR(distance_px, 0.0, 1e-6);
  }
}

TEST(EpipolarLine, IsZeroForARayThroughTheOtherCamera) {
  const auto a = camera_at({4.0, 0.0, 1.0});
  const auto b = camera_at({-4.0, 0.0, 1.0});
  const auto e = essential(a.camera_from_world, b.camera_from_world);

  EXPECT_TRUE(epipolar_line(e, seen(a, {-4.0, 0.0, 1.0})).n.isZero());
}

}  // namespace epipolar_test
}  // namespace mocap::geometry
