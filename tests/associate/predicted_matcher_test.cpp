#include "associate/predicted/predicted_matcher.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <set>
#include <vector>

#include "support/marker_world.h"

namespace mocap::associate {
namespace predicted_matcher_test {

using Eigen::Vector3d;
using namespace mocap::test;

constexpr std::size_t kCameras = 6;

// Six cameras and a matcher without the steps for new markers.
struct Matching {
  explicit Matching(std::uint32_t seed) : random(seed) {}

  const Matches& match(const SeenWorld& world, const Predictions& predictions) {
    matches = std::make_unique<Matches>();
    rays->begin(world.set);
    matcher->match(*rays, predictions, *matches);
    matcher->append_bearing_only(*rays, predictions, *matches);
    return *matches;
  }

  std::mt19937 random;
  Rig rig = ring(kCameras);
  MatchSettings settings;
  RigError error{settings.calibration_px, kCameras};
  std::unique_ptr<RayTable> rays = std::make_unique<RayTable>(rig);
  std::unique_ptr<PredictedMatcher> matcher = std::make_unique<PredictedMatcher>(settings, kCameras, error);
  std::unique_ptr<Matches> matches;
};

// Removes the blobs of a marker in all views but the first `views` that see it.
void hide(SeenWorld& world, int marker, int views) {
  for (std::size_t v = 0; v < world.frames.size(); ++v) {
    auto& marker_of = world.marker_of[v];
    for (std::size_t b = 0; b < marker_of.size(); ++b) {
      if (marker_of[b] != marker || views-- > 0) continue;
      world.frames[v]->blobs.erase_unordered(b);
      marker_of[b] = marker_of.back();
      marker_of.pop_back();
      break;
    }
  }
}

const Match* match_of(const Matches& matches, std::uint32_t marker) {
  const auto found = std::ranges::find(matches.matches, marker, &Match::prediction);
  return found == matches.matches.end() ? nullptr : &*found;
}

TEST(PredictedMatcher, GivesEachMarkerTheBlobsOfItsViews) {
  Matching given(41);
  const auto markers = cloud(40, given.random);
  const auto world = see(given.rig, markers, {.sigma_px = 0.1, .missed = 0.1, .false_blobs = 0.2}, given.random);

  const Matches& matches = given.match(world, expect(markers, 0.003, given.random));

  std::size_t right = 0, wrong = 0, visible = 0;
  for (const Match& match : matches.matches) {
    for (const BlobRef& seen : match.sightings) {
      const bool is_right = world.marker_of[seen.view][seen.blob] == static_cast<int>(match.prediction);
      ++(is_right ? right : wrong);
    }
    ASSERT_TRUE(match.triangulation);
    // 0.1 px at 4 m and a focal length of 900 px is 0.4 mm.
    EXPECT_LT((match.triangulation->point.v - markers[match.prediction]).norm(), 0.003);
  }
  for (int m = 0; m < 40; ++m) visible += static_cast<std::size_t>(world.views_of(m));
  EXPECT_GE(right, visible * 98 / 100);
  EXPECT_LE(wrong, visible / 100);
}

TEST(PredictedMatcher, LeavesOutABlobOnWhichTheOtherViewsDisagree) {
  Matching given(42);
  const std::vector<Vector3d> markers{{0.0, 0.0, 1.0}};
  const auto world = see(given.rig, markers, {.sigma_px = 0.05}, given.random);
  ASSERT_EQ(world.views_of(0), static_cast<int>(kCameras));
  world.frames[2]->blobs[0].centroid.v.x() +=
      8.0;  // inside the gate of the prediction, outside that of the other views

  const Matches& matches = given.match(world, expect(markers, 0.02, given.random));

  ASSERT_EQ(matches.matches.size(), 1U);
  EXPECT_EQ(matches.matches[0].sightings.size(), kCameras - 1);
  for (const BlobRef& seen : matches.matches[0].sightings) EXPECT_NE(seen.view, 2);
  EXPECT_LT((matches.matches[0].triangulation->point.v - markers[0]).norm(), 0.001);  // m: 0.05 px at 4 m is 0.2 mm
}

TEST(PredictedMatcher, GivesNoBlobToTwoMarkers) {
  Matching given(43);
  // Pairs of markers 1 cm apart with predictions that are as uncertain: the gates contain both blobs.
  std::vector<Vector3d> markers = cloud(15, given.random);
  for (int i = 0; i < 15; ++i) markers.push_back(markers[static_cast<std::size_t>(i)] + Vector3d(0.01, 0.0, 0.0));
  const auto world = see(given.rig, markers, {.sigma_px = 0.05}, given.random);

  const Matches& matches = given.match(world, expect(markers, 0.004, given.random));

  std::set<std::pair<std::uint16_t, std::uint16_t>> taken;
  for (const Match& match : matches.matches) {
    for (const BlobRef& seen : match.sightings) EXPECT_TRUE(taken.emplace(seen.view, seen.blob).second);
  }
  EXPECT_GE(matches.matches.size(), 25U);
}

TEST(PredictedMatcher, ReportsAMarkerInOneViewAsABearing) {
  Matching given(44);
  const auto markers = cloud(12, given.random);
  auto world = see(given.rig, markers, {.sigma_px = 0.05}, given.random);
  hide(world, 4, 1);

  const Matches& matches = given.match(world, expect(markers, 0.003, given.random));

  EXPECT_EQ(match_of(matches, 4), nullptr);
  EXPECT_EQ(matches.matches.size(), 11U);
  EXPECT_EQ(matches.seen_once, 1U);
  ASSERT_EQ(matches.bearing_only.size(), 1U);
  const BearingOnlyObservation& bearing = matches.bearing_only[0];
  EXPECT_EQ(bearing.prediction, 4U);
  EXPECT_EQ(world.marker_of[bearing.sighting.view][bearing.sighting.blob], 4);
  const CameraModel& camera = given.rig[bearing.sighting.view];
  EXPECT_LT((bearing.eye.v - camera.centre().v).norm(), 1e-12);  // m: rounding
  // 0.05 px at a focal length of 900 px are 0.06 mrad in each axis.
  EXPECT_LT((bearing.direction - (markers[4] - camera.centre().v).normalized()).norm(), 4 * 0.06e-3);
  EXPECT_NEAR(bearing.sigma_rad, 0.06e-3, 0.02e-3);
  EXPECT_FALSE(bearing.is_ambiguous);
}

TEST(PredictedMatcher, MarksABearingAsAmbiguousIfAnotherHiddenMarkerIsAsLikely) {
  Matching given(45);
  std::vector<Vector3d> markers = cloud(6, given.random);
  markers.push_back(markers[5] + Vector3d(0.0, 0.0, 0.01));
  auto world = see(given.rig, markers, {.sigma_px = 0.05}, given.random);
  hide(world, 5, 1);
  hide(world, 6, 0);

  const Matches& matches = given.match(world, expect(markers, 0.01, given.random));

  ASSERT_EQ(matches.bearing_only.size(), 1U);
  EXPECT_GE(matches.bearing_only[0].prediction, 5U);
  EXPECT_TRUE(matches.bearing_only[0].is_ambiguous);
}

TEST(PredictedMatcher, MatchesNothingWithoutBlobsOrPredictions) {
  Matching given(46);
  const auto markers = cloud(5, given.random);
  const auto world = see(given.rig, markers, {}, given.random);
  const auto dark = see(given.rig, {}, {}, given.random);

  EXPECT_TRUE(given.match(world, {}).matches.empty());
  const Matches& of_dark = given.match(dark, expect(markers, 0.003, given.random));

  EXPECT_TRUE(of_dark.matches.empty());
  EXPECT_TRUE(of_dark.bearing_only.empty());
  EXPECT_EQ(of_dark.seen_once, 0U);
}

TEST(PredictedMatcher, LeavesMarkersOutsideTheVolumeUnmatched) {
  Matching given(47);
  given.settings.volume_max_m.z() = 1.0;
  const std::vector<Vector3d> markers{{0.0, 0.0, 0.5}, {0.0, 0.0, 1.5}};
  const auto world = see(given.rig, markers, {.sigma_px = 0.05}, given.random);

  const Matches& matches = given.match(world, expect(markers, 0.003, given.random));

  EXPECT_NE(match_of(matches, 0), nullptr);
  EXPECT_EQ(match_of(matches, 1), nullptr);
}

}  // namespace predicted_matcher_test
}  // namespace mocap::associate
