#include "associate/match_triangulator.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <random>

#include "associate/multi_view_matcher.h"
#include "support/marker_world.h"

namespace mocap::associate {
namespace match_triangulator_test {

using namespace mocap::test;
using Eigen::Vector3d;

// The true matches: the blobs of each marker in all views.
Matches true_matches(const SeenWorld& world, std::size_t markers) {
  Matches matches;
  for (std::size_t m = 0; m < markers; ++m) {
    Match match;
    match.prediction = static_cast<std::uint32_t>(m);
    for (std::size_t v = 0; v < world.marker_of.size(); ++v) {
      for (std::size_t b = 0; b < world.marker_of[v].size(); ++b) {
        if (world.marker_of[v][b] != static_cast<int>(m)) continue;
        match.sightings.push_back({static_cast<std::uint16_t>(v), static_cast<std::uint16_t>(b)});
      }
    }
    matches.matches.push_back(match);
  }
  return matches;
}

TEST(MatchTriangulator, HasErrorsThatAgreeWithItsCovariance) {
  std::mt19937 random(1);
  const Rig rig = ring(8);
  const auto triangulator = make_triangulator({}, rig);
  double nees = 0.0;
  int count = 0;
  for (int k = 0; k < 50; ++k) {
    const auto markers = cloud(40, random);
    const auto world = see(rig, markers, {.sigma_px = 0.15, .missed = 0.4}, random);
    for (const Marker& marker : triangulator->triangulate(world.set, true_matches(world, 40))) {
      const Vector3d error = marker.position.v - markers[marker.prediction];
      nees += error.dot(marker.covariance_m2.inverse() * error);
      ++count;
      EXPECT_LT(marker.residual_px, 0.75);  // five standard deviations
    }
  }

  EXPECT_GT(count, 1850);  // fewer than two cameras see some of the 2000 markers
  // 1900 chi-squares with 3 degrees of freedom: mean 3, standard deviation of the mean 0.056.
  EXPECT_NEAR(nees / count, 3.0, 0.2);
}

TEST(MatchTriangulator, ReportsTheMatchAndTheNumberOfCameras) {
  std::mt19937 random(2);
  const Rig rig = ring(5);
  const std::vector<Vector3d> markers{{0.0, 0.0, 1.0}, {0.5, 0.2, 1.4}};
  const auto world = see(rig, markers, {}, random);
  Matches matches = true_matches(world, 2);
  matches.matches[0].sightings.resize(1);  // one view gives no point
  matches.matches[1].sightings.resize(3);
  const auto triangulator = make_triangulator({}, rig);

  const Markers& found = triangulator->triangulate(world.set, matches);

  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].match, 1u);
  EXPECT_EQ(found[0].prediction, 1u);
  EXPECT_EQ(found[0].cameras, 3u);
  EXPECT_EQ(found[0].seen_by, 0b111u);
}

TEST(MatchTriangulator, RemovesAnOutlierView) {
  std::mt19937 random(3);
  const Rig rig = ring(5);
  const std::vector<Vector3d> markers{{0.1, 0.0, 1.0}};
  auto world = see(rig, markers, {.sigma_px = 0.05}, random);
  world.frames[3]->blobs[0].centroid.v.y() += 20.0;
  const auto triangulator = make_triangulator({}, rig);

  const Markers& found = triangulator->triangulate(world.set, true_matches(world, 1));

  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].cameras, 4u);
  EXPECT_EQ(found[0].seen_by, 0b10111u);
  EXPECT_LT((found[0].position.v - markers[0]).norm(), 1e-3);  // m
}

TEST(MatchTriangulator, DropsAPointWithAnUncertainDepth) {
  std::mt19937 random(4);
  const Rig rig{camera_at({4.0, 0.0, 1.0}), camera_at({-4.0, 0.0, 1.0})};  // the cameras face each other
  const std::vector<Vector3d> markers{{0.3, 0.01, 1.01}};
  const auto world = see(rig, markers, {}, random);

  EXPECT_TRUE(make_triangulator({}, rig)->triangulate(world.set, true_matches(world, 1)).empty());
}

TEST(MatchTriangulator, FindsTheMarkersOfAWalkerWithinTwoMillimetresWithFourCameras) {
  std::mt19937 random(5);
  const Rig rig = ring(4);
  const auto markers = walker(0.3);
  const auto world = see(rig, markers, {.sigma_px = 0.1}, random);
  const auto matcher = make_matcher({}, rig);
  const auto triangulator = make_triangulator({}, rig);

  const Markers& found =
      triangulator->triangulate(world.set, matcher->match(world.set, expect(markers, 0.005, random)));

  ASSERT_EQ(found.size(), 18u);
  for (const Marker& marker : found)
    EXPECT_LT((marker.position.v - markers[marker.prediction]).norm(), 2e-3);  // 5 sigma
}

TEST(MatchTriangulator, IncludesTheRigErrorInTheCovariance) {
  std::mt19937 random(7);
  std::normal_distribution<double> error_rad(0.0, 0.15 / 900.0);  // 0.15 px
  const Rig rig = ring(8);
  double nees = 0.0;
  int count = 0;
  for (int k = 0; k < 40; ++k) {
    Rig wrong = rig;
    for (CameraModel& camera : wrong) {
      const Eigen::Matrix3d off = Eigen::AngleAxisd(error_rad(random), Vector3d::UnitX()).toRotationMatrix() *
                                  Eigen::AngleAxisd(error_rad(random), Vector3d::UnitY()).toRotationMatrix();
      camera.camera_from_world.rotation = off * camera.camera_from_world.rotation;
      camera.camera_from_world.translation = off * camera.camera_from_world.translation;
    }
    const auto triangulator = make_triangulator({}, wrong);
    const auto markers = cloud(20, random);
    for (int set = 0; set < 60; ++set) {
      const auto world = see(rig, markers, {.sigma_px = 0.05}, random);
      for (const Marker& marker : triangulator->triangulate(world.set, true_matches(world, 20))) {
        if (set < 50) continue;  // the estimate of the rig error has not converged
        const Vector3d error = marker.position.v - markers[marker.prediction];
        nees += error.dot(marker.covariance_m2.inverse() * error);
        ++count;
      }
    }
  }
  // Tolerance 25 %: scatter of 320 camera errors, and 10 % of the running median.
  EXPECT_NEAR(nees / count, 3.0, 0.75);
}

}  // namespace match_triangulator_test
}  // namespace mocap::associate
