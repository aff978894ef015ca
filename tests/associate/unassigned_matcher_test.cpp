#include "associate/unassigned/unassigned_matcher.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <random>
#include <vector>

#include "associate/multi_view_matcher.h"
#include "geometry/ray_caster.h"
#include "geometry/triangulation.h"
#include "support/marker_world.h"

namespace mocap::associate {
namespace {

using namespace mocap::test;

// The sightings of a match, each as certain as its blob says.
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

TEST(MatchNew, TellsWhereTheRaysOfANewMarkerMeetAsCertainAsTheirBlobsAre) {
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
    // Depths are right to 1 %, and so are the weights.
    const Eigen::Vector3d off = match.triangulation->point.v - best->point.v;
    EXPECT_LT(std::sqrt(off.dot(best->covariance_m2.inverse() * off)), 0.03);
    EXPECT_NEAR(match.triangulation->covariance_m2.trace(), best->covariance_m2.trace(),
                0.03 * best->covariance_m2.trace());
  }
}

TEST(MatchNew, FindsEachViewOfANewMarkerWhereTheRigIsWrongByMoreThanBlobsAre) {
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

}  // namespace
}  // namespace mocap::associate
