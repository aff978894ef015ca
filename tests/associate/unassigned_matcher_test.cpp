#include "associate/unassigned/unassigned_matcher.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "associate/multi_view_matcher.h"
#include "geometry/ray_caster.h"
#include "geometry/triangulation.h"
#include "support/marker_world.h"

namespace mocap::associate {
namespace unassigned_matcher_test {

using namespace mocap::test;

// The sightings of a match with the sigma_px of their blobs.
std::vector<geometry::Sighting> sightings_of(const Rig& rig, const FrameSet& set, const Match& match) {
  std::vector<geometry::Sighting> all;
  for (const BlobRef& seen : match.sightings) {
    const CameraModel& camera = rig[set.views[seen.view]->camera.value];
    const Blob& blob = set.views[seen.view]->blobs[seen.blob];
    const auto ray = geometry::ray_of(camera.lens, blob.centroid);
    all.push_back({&camera.camera_from_world, ray->point, ray->px_from_ray, blob.sigma_px, seen.view});
  }
  return all;
}

TEST(UnassignedMatcher, GivesANewMarkerTheCovarianceOfItsBlobs) {
  std::mt19937 random(7);
  const Rig rig = ring(8);
  auto world = see(rig, cloud(40, random), {.sigma_px = 0.1, .missed = 0.2}, random);
  for (const auto& frame : world.frames) {
    for (std::size_t b = 0; b < frame->blobs.size(); ++b) frame->blobs[b].sigma_px = b % 2 == 0 ? 0.05 : 0.3;
  }
  const auto matcher = make_matcher({}, rig);

  const Matches& matches = matcher->match(world.set, {});

  ASSERT_GE(matches.matches.size(), 35u);
  for (const Match& match : matches.matches) {
    ASSERT_TRUE(match.triangulation.has_value());
    const auto best = geometry::refine(sightings_of(rig, world.set, match), match.triangulation->point);
    ASSERT_TRUE(best);
    // The weights use depths that are correct to 1 %.
    const Eigen::Vector3d off = match.triangulation->point.v - best->point.v;
    EXPECT_LT(std::sqrt(off.dot(best->covariance_m2.inverse() * off)), 0.03);
    EXPECT_NEAR(match.triangulation->covariance_m2.trace(), best->covariance_m2.trace(),
                0.03 * best->covariance_m2.trace());
  }
}

TEST(UnassignedMatcher, FindsEachViewOfANewMarkerDespiteARigErrorAboveBlobNoise) {
  std::mt19937 random(8);
  const Rig rig = ring(8);
  auto world = see(rig, cloud(30, random), {.sigma_px = 0.02}, random);
  std::size_t blobs = 0;
  for (const auto& frame : world.frames) {
    std::uniform_real_distribution<double> off(-0.5, 0.5);
    const Eigen::Vector2d wrong(off(random), off(random));
    for (Blob& blob : frame->blobs) {
      blob.centroid.v += wrong;
      blob.sigma_px = 0.02;
    }
    blobs += frame->blobs.size();
  }
  const auto matcher = make_matcher({.calibration_px = 0.3}, rig);

  std::size_t matched = 0;
  for (const Match& match : matcher->match(world.set, {}).matches) matched += match.sightings.size();

  EXPECT_GE(matched, blobs * 98 / 100);
}

// Distance of the nearest candidate.
double nearest_candidate_m(const Matches& matches, const Eigen::Vector3d& marker) {
  double nearest_m = 1e9;
  for (const CandidatePoint& one : matches.candidates)
    nearest_m = std::min(nearest_m, (one.position.v - marker).norm());
  return nearest_m;
}

TEST(UnassignedMatcher, GivesACandidateIfAThirdOfFewCamerasCouldSeeTheMarker) {
  std::mt19937 random(4);
  const Rig rig = ring(4);
  const std::vector<Eigen::Vector3d> markers{{0.1, 0.2, 1.1}};
  auto world = see(rig, markers, {.sigma_px = 0.1}, random);
  world.frames[2]->blobs.clear();
  world.frames[3]->blobs.clear();
  const auto matcher = make_matcher({}, rig);

  const Matches& matches = matcher->match(world.set, {});

  EXPECT_EQ(matches.matches.size(), 0u);
  EXPECT_EQ(matches.unmatched_blobs, 2u);
  ASSERT_EQ(matches.candidates.size(), 1u);
  // Three standard deviations, with the rig error of half a pixel that is assumed at first.
  const Eigen::Vector3d off_m = matches.candidates[0].position.v - markers[0];
  EXPECT_LT(off_m.dot(matches.candidates[0].covariance_m2.inverse() * off_m), 9.0);
  EXPECT_LT(off_m.norm(), 0.005);
}

TEST(UnassignedMatcher, GivesNoCandidateWhereHalfOfTheCamerasAreEnoughForAMatch) {
  std::mt19937 random(4);
  const Rig rig = ring(8);
  const std::vector<Eigen::Vector3d> markers{{0.1, 0.2, 1.1}};
  auto world = see(rig, markers, {.sigma_px = 0.1}, random);
  for (std::size_t camera = 2; camera < 8; ++camera) world.frames[camera]->blobs.clear();
  const auto matcher = make_matcher({}, rig);

  const Matches& matches = matcher->match(world.set, {});

  EXPECT_EQ(matches.matches.size(), 0u);
  EXPECT_EQ(matches.candidates.size(), 0u);
}

TEST(UnassignedMatcher, GivesACandidateForEachPairOfRaysThatMeetIfPairsShareABlob) {
  std::mt19937 random(4);
  const Rig rig{camera_at({4.0, 0.0, 1.0}), camera_at({0.0, 4.0, 1.0})};
  // Both markers are at the height of the cameras: all four rays are in one plane, and each meets both others.
  const std::vector<Eigen::Vector3d> markers{{0.2, 0.1, 1.0}, {-0.3, -0.2, 1.0}};
  const auto world = see(rig, markers, {.sigma_px = 0.1}, random);
  const auto matcher = make_matcher({}, rig);

  const Matches& matches = matcher->match(world.set, {});

  EXPECT_EQ(matches.matches.size(), 0u);
  EXPECT_EQ(matches.candidates.size(), 4u);
  for (const Eigen::Vector3d& marker : markers) EXPECT_LT(nearest_candidate_m(matches, marker), 0.005);
}

TEST(UnassignedMatcher, GivesNoCandidateOfBlobsThatAMatchHas) {
  std::mt19937 random(9);
  const Rig rig = ring(4);
  const auto world = see(rig, cloud(20, random), {.sigma_px = 0.1}, random);
  const auto matcher = make_matcher({}, rig);

  const Matches& matches = matcher->match(world.set, {});

  ASSERT_EQ(matches.matches.size(), 20u);
  EXPECT_EQ(matches.candidates.size(), 0u);
}

}  // namespace unassigned_matcher_test
}  // namespace mocap::associate
