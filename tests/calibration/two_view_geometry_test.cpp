#include "calibration/wand/two_view_geometry.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "scene/random.h"
#include "scene/ring_rig.h"

namespace mocap::calibration {
namespace two_view_geometry_test {

using Eigen::Vector3d;

const Wand kWand{{0.0, 0.16, 0.5}};

struct TwoCameras {
  CameraFromWorld a = scene::look_at({4.0, 0.0, 2.0}, {0.0, 0.0, 1.0});
  CameraFromWorld b = scene::look_at({0.0, 4.0, 2.5}, {0.0, 0.0, 1.0});
  CameraFromCamera b_from_a = b * a.inverse();
};

WandRays rays_of(const CameraFromWorld& camera, const std::array<Vector3d, 3>& markers) {
  WandRays rays;
  for (std::size_t m = 0; m < 3; ++m) rays.ray[m] = (camera * WorldPoint{markers[m]}).v.hnormalized();
  return rays;
}

// Exact rays to a wand in random poses.
std::vector<WandCorrespondence> wave(const TwoCameras& cameras, const Wand& wand, int count) {
  scene::Random random(7);
  std::vector<WandCorrespondence> correspondences;
  for (int i = 0; i < count; ++i) {
    const Vector3d middle(random.uniform() - 0.5, random.uniform() - 0.5, 0.5 + random.uniform());
    const Vector3d direction = Vector3d(random.normal(), random.normal(), random.normal()).normalized();
    std::array<Vector3d, 3> markers;
    for (std::size_t m = 0; m < 3; ++m) markers[m] = middle + (wand.marks_m[m] - wand.middle_m()) * direction;
    correspondences.push_back({rays_of(cameras.a, markers), rays_of(cameras.b, markers)});
  }
  return correspondences;
}

TEST(TwoViewGeometry, EstimatesTheMetricPoseFromExactRays) {
  const TwoCameras cameras;

  const auto geometry = estimate_two_view_geometry(wave(cameras, kWand, 60), kWand, 1e-3);

  ASSERT_TRUE(geometry);
  EXPECT_EQ(geometry->inliers, 60);
  EXPECT_LT((geometry->b_from_a.rotation - cameras.b_from_a.rotation).norm(), 1e-6);
  EXPECT_LT((geometry->b_from_a.translation - cameras.b_from_a.translation).norm(), 1e-5);  // m
  EXPECT_NEAR(geometry->median_angle_rad, std::numbers::pi / 2.0, 0.3);
}

TEST(TwoViewGeometry, ResolvesTheOrderOfASymmetricWand) {
  const TwoCameras cameras;
  const Wand symmetric{{0.0, 0.25, 0.5}};
  auto correspondences = wave(cameras, symmetric, 60);
  for (std::size_t i = 0; i < correspondences.size(); ++i) {
    correspondences[i].a.ends_unknown = correspondences[i].b.ends_unknown = true;
    if (i % 2 == 0) std::ranges::reverse(correspondences[i].b.ray);
  }

  const auto geometry = estimate_two_view_geometry(correspondences, symmetric, 1e-3);

  ASSERT_TRUE(geometry);
  EXPECT_LT((geometry->b_from_a.translation - cameras.b_from_a.translation).norm(), 1e-3);  // m
}

TEST(TwoViewGeometry, RefusesRaysOfUnrelatedWands) {
  const TwoCameras cameras;
  auto correspondences = wave(cameras, kWand, 60);
  std::ranges::rotate(correspondences, correspondences.begin() + 1);
  const auto others = wave(cameras, kWand, 60);
  for (std::size_t i = 0; i < 60; ++i) correspondences[i].b = others[i].b;

  const auto geometry = estimate_two_view_geometry(correspondences, kWand, 1e-4);

  EXPECT_TRUE(!geometry || geometry->inlier_fraction < 0.3);
}

TEST(TriangulateMidpoint, FindsAPointInFrontOfBothCamerasOnly) {
  const TwoCameras cameras;
  const WorldPoint point{{0.2, -0.1, 1.3}};
  const Eigen::Vector2d a = (cameras.a * point).v.hnormalized();
  const Eigen::Vector2d b = (cameras.b * point).v.hnormalized();

  const auto found = triangulate_midpoint(cameras.b_from_a, a, b);
  const WorldPoint behind{cameras.a.inverse() * CameraPoint{{0.5, 0.2, -2.0}}};
  const auto none = triangulate_midpoint(cameras.b_from_a, (cameras.a * behind).v.hnormalized(),
                                         (cameras.b * behind).v.hnormalized());

  ASSERT_TRUE(found);
  EXPECT_LT((*found - (cameras.a * point).v).norm(), 1e-9);
  EXPECT_FALSE(none);
}

}  // namespace two_view_geometry_test
}  // namespace mocap::calibration
