#include "associate/multi_view_matcher.h"
#include "associate/identified_matcher.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <map>
#include <memory>
#include <ostream>
#include <set>

#include "support/marker_world.h"

namespace mocap::associate {
namespace multi_view_matcher_test {

using namespace mocap::test;
using Eigen::Vector3d;

// Matches compared with the truth.
struct Score {
  int ghosts = 0;    // matches without a marker
  int doubles = 0;   // additional matches of one marker
  int foreign = 0;   // sightings of another marker or of clutter in the match of a marker
  int mistaken = 0;  // predicted markers matched to the blobs of another marker
  std::set<int> found;
};

// The marker to which most sightings of a match belong, and the number of these sightings.
std::pair<int, std::size_t> shown_by(const SeenWorld& world, const Match& match) {
  std::map<int, std::size_t> votes;
  for (const BlobRef& seen : match.sightings) {
    ++votes[world.marker_of[seen.view][seen.blob]];
    if (world.also_of[seen.view][seen.blob] >= 0) ++votes[world.also_of[seen.view][seen.blob]];
  }
  votes.erase(-1);
  const auto most = std::ranges::max_element(votes, {}, [](const auto& vote) { return vote.second; });
  return most == votes.end() ? std::pair<int, std::size_t>{-1, 0} : std::pair<int, std::size_t>(*most);
}

Score score(const SeenWorld& world, const Matches& matches) {
  Score total;
  for (const Match& match : matches.matches) {
    const auto [marker, votes] = shown_by(world, match);
    if (marker < 0 || 2 * votes <= match.sightings.size()) {
      ++total.ghosts;
      continue;
    }
    total.foreign += static_cast<int>(match.sightings.size() - votes);
    if (!total.found.insert(marker).second) ++total.doubles;
    if (match.prediction != Match::kNew && static_cast<int>(match.prediction) != marker) ++total.mistaken;
  }
  return total;
}

// The blobs of a match as sorted pairs (camera, blob), independent of the order of the views.
std::set<std::set<std::pair<std::uint32_t, std::uint32_t>>> content(const FrameSet& set, const Matches& matches) {
  std::set<std::set<std::pair<std::uint32_t, std::uint32_t>>> all;
  for (const Match& match : matches.matches) {
    std::set<std::pair<std::uint32_t, std::uint32_t>> blobs;
    for (const BlobRef& seen : match.sightings) blobs.insert({set.views[seen.view]->camera.value, seen.blob});
    all.insert(blobs);
  }
  return all;
}

TEST(MultiViewMatcher, FindsEveryNewMarkerInPerfectViews) {
  std::mt19937 random(1);
  const Rig rig = ring(8);
  const auto markers = cloud(40, random);
  const auto world = see(rig, markers, {.sigma_px = 0.1}, random);

  const auto matcher = make_matcher({}, rig);
  const Matches& matches = matcher->match(world.set, {});

  const Score result = score(world, matches);
  EXPECT_EQ(result.found.size(), 40u);
  EXPECT_EQ(result.ghosts + result.doubles + result.foreign, 0);
  EXPECT_EQ(matches.unmatched_blobs, 0u);
  EXPECT_EQ(matches.skipped, 0u);
}

struct Scene {
  std::size_t cameras;
  bool predicted;
};

std::ostream& operator<<(std::ostream& out, const Scene& scene) {
  return out << scene.cameras << (scene.predicted ? " cameras, known" : " cameras, new");
}

class MultiViewMatcherIn : public testing::TestWithParam<Scene> {};

TEST_P(MultiViewMatcherIn, FindsNearlyAllMarkersThatThreeCamerasSeeAndFewGhosts) {
  std::mt19937 random(5);
  const Rig rig = ring(GetParam().cameras);
  const auto matcher = make_matcher({}, rig);
  int visible = 0;
  int found = 0;
  Score sum;

  for (int k = 0; k < 50; ++k) {
    const auto markers = cloud(40, random);
    const auto world =
        see(rig, markers, {.sigma_px = 0.1, .missed = 0.3, .false_blobs = 0.1, .merge_below_px = 4.0}, random);
    const auto predicted = GetParam().predicted ? expect(markers, 0.005, random) : Predictions{};
    const Score result = score(world, matcher->match(world.set, predicted));
    for (int m = 0; m < 40; ++m) {
      if (world.views_of(m) < 3) continue;
      ++visible;
      found += result.found.contains(m) ? 1 : 0;
    }
    sum.ghosts += result.ghosts;
    sum.doubles += result.doubles;
    sum.mistaken += result.mistaken;
  }

  EXPECT_GE(found, 0.995 * visible) << visible;
  EXPECT_LE(sum.ghosts, 5);  // of about 2000 matches
  EXPECT_LE(sum.doubles, 1);
  EXPECT_LE(sum.mistaken, 1);
}

INSTANTIATE_TEST_SUITE_P(Scenes, MultiViewMatcherIn,
                         testing::Values(Scene{4, false}, Scene{4, true}, Scene{8, false}, Scene{8, true},
                                         Scene{16, false}, Scene{16, true}));

TEST(MultiViewMatcher, FollowsAWalkingFigureOf18MarkersWithFourCameras) {
  std::mt19937 random(3);
  const Rig rig = ring(4);
  const auto matcher = make_matcher({}, rig);
  for (int k = 0; k < 100; ++k) {
    const auto markers = walker(k / 60.0);
    const auto before = walker((k - 1) / 60.0);
    const auto world = see(rig, markers, {.sigma_px = 0.05, .merge_below_px = 4.0}, random);
    Predictions predicted = expect(before, 0.001, random);  // one frame old: up to 20 mm off
    for (auto& marker : predicted.markers) marker.covariance_m2 = Eigen::Matrix3d::Identity() * 1e-4;

    const Score cold = score(world, matcher->match(world.set, {}));
    const Score known = score(world, matcher->match(world.set, predicted));

    for (int m = 0; m < 18; ++m) {
      EXPECT_TRUE(cold.found.contains(m) || world.views_of(m) < 3) << k << " marker " << m;
      EXPECT_TRUE(known.found.contains(m) || world.views_of(m) < 2) << k << " marker " << m;
    }
    EXPECT_EQ(cold.ghosts + cold.foreign, 0) << k;
    EXPECT_EQ(known.ghosts + known.foreign + known.mistaken, 0) << k;
  }
}

TEST(MultiViewMatcher, NeedsTwoViewsForAPredictedMarkerAndCountsAMarkerSeenOnce) {
  std::mt19937 random(2);
  const Rig rig = ring(4);
  const std::vector<Vector3d> markers{{0.0, 0.0, 1.0}, {0.4, 0.1, 1.2}};
  auto world = see(rig, markers, {.sigma_px = 0.05}, random);
  world.frames[1]->blobs.erase_unordered(1);  // only cameras 0 and 3 see the second marker
  world.frames[2]->blobs.erase_unordered(1);
  const auto predicted = expect(markers, 0.003, random);
  const auto matcher = make_matcher({}, rig);

  ASSERT_EQ(matcher->match(world.set, predicted).matches.size(), 2u);

  world.frames[3]->blobs.erase_unordered(1);
  const Matches& matches = matcher->match(world.set, predicted);
  EXPECT_EQ(matches.matches.size(), 1u);
  EXPECT_EQ(matches.seen_once, 1u);
  EXPECT_EQ(matches.unmatched_blobs, 1u);
}

TEST(MultiViewMatcher, ReportsTheBearingOfAMarkerThatOneCameraSees) {
  std::mt19937 random(2);
  const Rig rig = ring(4);
  const std::vector<Vector3d> markers{{0.0, 0.0, 1.0}, {0.4, 0.1, 1.2}};
  auto world = see(rig, markers, {.sigma_px = 0.05}, random);
  for (const std::size_t camera : {0u, 1u, 2u}) world.frames[camera]->blobs.erase_unordered(1);
  const auto matcher = make_matcher({}, rig);

  const Matches& matches = matcher->match(world.set, expect(markers, 0.003, random));

  ASSERT_EQ(matches.bearing_only.size(), 1u);
  const BearingOnlyObservation& bearing_only = matches.bearing_only[0];
  EXPECT_EQ(bearing_only.prediction, 1u);
  EXPECT_EQ(bearing_only.sighting.view, 3u);
  EXPECT_EQ(bearing_only.sighting.blob, 1u);
  EXPECT_LT((bearing_only.eye.v - rig[3].centre().v).norm(), 1e-12);
  // The ray passes the marker at a distance of at most five standard deviations.
  const Vector3d to_marker = markers[1] - bearing_only.eye.v;
  EXPECT_NEAR(bearing_only.direction.norm(), 1.0, 1e-12);
  EXPECT_LT(to_marker.cross(bearing_only.direction).norm(), 5.0 * bearing_only.sigma_rad * to_marker.norm());
  EXPECT_NEAR(bearing_only.sigma_rad, 0.05 / 900.0, 0.2 * 0.05 / 900.0);  // rad; the lens distorts a little

  EXPECT_TRUE(matcher->match(world.set, {}).bearing_only.empty());  // no prediction
}

TEST(MultiViewMatcher, ReportsNoBearingIfANewMarkerHasTheBlob) {
  std::mt19937 random(6);
  const Rig rig = ring(4);
  const std::vector<Vector3d> markers{{0.0, 0.0, 1.0}};
  const auto world = see(rig, markers, {.sigma_px = 0.05}, random);
  // The prediction lies elsewhere on the ray of camera 1: only that view has the blob in its gate.
  const Vector3d eye = rig[1].centre().v;
  const std::vector<Vector3d> elsewhere{eye + 0.7 * (markers[0] - eye)};
  const auto matcher = make_matcher({}, rig);

  const Matches& matches = matcher->match(world.set, expect(elsewhere, 0.001, random));

  ASSERT_EQ(matches.matches.size(), 1u);
  EXPECT_EQ(matches.matches[0].prediction, Match::kNew);
  EXPECT_EQ(matches.seen_once, 1u);
  EXPECT_TRUE(matches.bearing_only.empty());
}

TEST(MultiViewMatcher, RemovesAViewWithAFalseBlobInTheGate) {
  std::mt19937 random(2);
  const Rig rig = ring(5);
  const std::vector<Vector3d> markers{{0.1, -0.2, 1.3}};
  auto world = see(rig, markers, {.sigma_px = 0.05}, random);
  world.frames[2]->blobs[0].centroid.v.x() += 5.0;  // the marker itself is hidden there
  Predictions predicted = expect(markers, 0.02, random);

  const auto matcher = make_matcher({}, rig);
  const Matches& matches = matcher->match(world.set, predicted);

  ASSERT_EQ(matches.matches.size(), 1u);
  EXPECT_EQ(matches.matches[0].sightings.size(), 4u);
  for (const BlobRef& seen : matches.matches[0].sightings) EXPECT_NE(seen.view, 2);
  EXPECT_EQ(matches.unmatched_blobs, 1u);
}

TEST(MultiViewMatcher, AssignsNearMarkersLikeABruteForceSearch) {
  std::mt19937 random(11);
  const Rig rig = ring(3);
  const MatchSettings settings;
  const auto matcher = make_matcher(settings, rig);
  for (int k = 0; k < 50; ++k) {
    // Four markers within a few cm: every gate contains all blobs.
    std::vector<Vector3d> markers;
    std::uniform_real_distribution<double> near(-0.03, 0.03);
    for (int m = 0; m < 4; ++m) markers.emplace_back(near(random), near(random), 1.0 + near(random));
    const auto world = see(rig, markers, {.sigma_px = 0.05}, random);
    const auto predicted = expect(markers, 0.004, random);

    const Matches& matches = matcher->match(world.set, predicted);

    // With equal covariances, the optimal assignment of each view has the least sum of squared distances.
    for (std::size_t view = 0; view < 3; ++view) {
      std::array<std::size_t, 4> order{0, 1, 2, 3};
      std::array<std::size_t, 4> best = order;
      double least = std::numeric_limits<double>::infinity();
      do {
        double sum = 0.0;
        for (std::size_t m = 0; m < 4; ++m) {
          const auto pixel = geometry::project(rig[view], predicted.markers[m].position);
          sum += (pixel->v - world.frames[view]->blobs[order[m]].centroid.v).squaredNorm();
        }
        if (sum < least) {
          least = sum;
          best = order;
        }
      } while (std::ranges::next_permutation(order).found);
      for (const Match& match : matches.matches) {
        if (match.prediction == Match::kNew || match.sightings.size() != 3) continue;
        EXPECT_EQ(match.sightings[view].blob, best[match.prediction]) << "set " << k << " view " << view;
      }
    }
  }
}

TEST(MultiViewMatcher, GivesTheSameMatchesForCamerasInAnyOrder) {
  std::mt19937 random(8);
  const Rig rig = ring(6);
  Rig turned;
  for (std::size_t c = 0; c < rig.size(); ++c) turned.push_back(rig[(c * 5 + 2) % 6]);
  const auto markers = cloud(30, random);
  const auto world = see(rig, markers, {.sigma_px = 0.1, .missed = 0.2, .false_blobs = 0.1}, random);
  const Matches first = make_matcher({}, rig)->match(world.set, {});

  FrameSet set = world.set;
  set.views.clear();
  std::vector<BlobFrame> frames(6);
  for (std::size_t c = 0; c < 6; ++c) {
    frames[c] = *world.frames[(c * 5 + 2) % 6];
    frames[c].camera = CameraId{static_cast<std::uint32_t>(c)};
    set.views.push_back(&frames[c]);
  }
  const Matches second = make_matcher({}, turned)->match(set, {});

  auto expected = content(world.set, first);
  auto result = decltype(expected){};
  for (const auto& match : content(set, second)) {
    std::set<std::pair<std::uint32_t, std::uint32_t>> blobs;
    for (const auto& [camera, blob] : match) blobs.insert({(camera * 5 + 2) % 6, blob});
    result.insert(blobs);
  }
  EXPECT_EQ(result, expected);
}

TEST(MultiViewMatcher, FindsNothingWithTwoCamerasThatFaceEachOther) {
  std::mt19937 random(4);
  const Rig rig{camera_at({4.0, 0.0, 1.0}), camera_at({-4.0, 0.0, 1.0})};
  const std::vector<Vector3d> markers{{0.5, 0.02, 1.02}, {-0.5, -0.03, 0.98}, {0.1, 0.0, 1.0}, {0.0, 0.04, 1.0}};
  const auto world = see(rig, markers, {.sigma_px = 0.1}, random);

  EXPECT_EQ(make_matcher({}, rig)->match(world.set, {}).matches.size(), 0u);
  EXPECT_EQ(make_matcher({}, rig)->match(world.set, expect(markers, 0.01, random)).matches.size(), 0u);
}

TEST(MultiViewMatcher, AcceptsTwoViewsOfANewMarkerOnlyIfTwoCamerasDeliver) {
  std::mt19937 random(4);
  const std::vector<Vector3d> markers{{0.1, 0.2, 1.1}};
  const Rig pair{camera_at({4.0, 0.0, 2.5}), camera_at({0.0, 4.0, 2.5})};
  const auto seen_by_pair = see(pair, markers, {.sigma_px = 0.1}, random);
  EXPECT_EQ(make_matcher({}, pair)->match(seen_by_pair.set, {}).matches.size(), 1u);

  const Rig three = ring(3);
  auto world = see(three, markers, {.sigma_px = 0.1}, random);
  world.frames[2]->blobs.clear();
  EXPECT_EQ(make_matcher({}, three)->match(world.set, {}).matches.size(), 0u);
  EXPECT_EQ(make_matcher({.min_views_new = 2}, three)->match(world.set, {}).matches.size(), 1u);

  world.set.views.pop_back();  // the third camera is late and might have seen the marker
  EXPECT_EQ(make_matcher({}, three)->match(world.set, {}).matches.size(), 0u);
  world.set.expected_views = 2;  // the third camera is known not to deliver
  EXPECT_EQ(make_matcher({}, three)->match(world.set, {}).matches.size(), 1u);
}

TEST(MultiViewMatcher, TakesTwoViewsForACandidateWhereTheOtherCamerasLookElsewhere) {
  std::mt19937 random(4);
  const std::vector<Vector3d> markers{{0.1, 0.2, 1.1}};
  const Rig rig{camera_at({4.0, 0.0, 2.5}), camera_at({0.0, 4.0, 2.5}), camera_at({0.0, 4.0, 2.5}, {0.0, 9.0, 1.0})};
  const auto world = see(rig, markers, {.sigma_px = 0.1}, random);
  ASSERT_TRUE(world.frames[2]->blobs.empty());
  const auto matcher = make_matcher({}, rig);

  const Matches& matches = matcher->match(world.set, {});

  EXPECT_EQ(matches.matches.size(), 0u);
  EXPECT_EQ(matches.candidates.size(), 1u);
}

TEST(MultiViewMatcher, AcceptsNeitherOfTwoPairsThatShareABlob) {
  std::mt19937 random(4);
  const Rig rig{camera_at({4.0, 0.0, 1.0}), camera_at({0.0, 4.0, 1.0})};
  // Both markers are at one height: they have the same epipolar line.
  const std::vector<Vector3d> markers{{0.2, 0.1, 1.0}, {-0.3, -0.2, 1.0}};
  const auto world = see(rig, markers, {.sigma_px = 0.1}, random);

  EXPECT_EQ(make_matcher({}, rig)->match(world.set, {}).matches.size(), 0u);
}

TEST(MultiViewMatcher, FindsNoNewMarkerInBlobsOfAPredictedOne) {
  std::mt19937 random(4);
  const Rig rig = ring(4);
  // View 2 sees one marker before the other as one blob, and has a false blob. View 3 misses the marker behind.
  const Vector3d behind(0.0, 0.0, 1.0);
  const Vector3d eye = rig[2].centre().v;
  const std::vector<Vector3d> markers{behind, eye + 0.9 * (behind - eye)};
  auto world = see(rig, markers, {.sigma_px = 0.05}, random);
  for (const std::size_t camera : {2u, 3u}) world.frames[camera]->blobs.erase_unordered(0);
  Blob elsewhere = world.frames[2]->blobs[0];
  elsewhere.centroid.v = {100.0, 100.0};
  world.frames[2]->blobs.push_back(elsewhere);
  const auto matcher = make_matcher({}, rig);
  const auto known = expect(std::vector<Vector3d>{markers[1]}, 0.003, random);

  const Matches& matches = matcher->match(world.set, known);

  // The marker behind has two exclusive blobs, but four cameras could see it.
  ASSERT_EQ(matches.matches.size(), 1u);
  EXPECT_EQ(matches.matches[0].prediction, 0u);
  EXPECT_EQ(matches.matches[0].sightings.size(), 4u);
  EXPECT_EQ(matches.unmatched_blobs, 3u);
}

TEST(MultiViewMatcher, FindsNothingIfAllEpipolarLinesCoincide) {
  std::mt19937 random(4);
  // Three cameras on a line and all markers on a parallel line: every blob lies on every epipolar line.
  const Rig rig{camera_at({4.0, -1.5, 1.0}, {0.0, 0.0, 1.0}), camera_at({4.0, 0.0, 1.0}, {0.0, 0.0, 1.0}),
                camera_at({4.0, 1.5, 1.0}, {0.0, 0.0, 1.0})};
  const std::vector<Vector3d> markers{{0.0, -0.4, 1.0}, {0.0, -0.1, 1.0}, {0.0, 0.2, 1.0}, {0.0, 0.5, 1.0}};
  auto world = see(rig, markers, {.sigma_px = 0.05}, random);
  world.frames[2]->blobs.clear();  // two views: any pair of blobs is possible

  EXPECT_EQ(make_matcher({.min_views_new = 2}, rig)->match(world.set, {}).matches.size(), 0u);
}

TEST(MultiViewMatcher, FindsAMarkerThatThreeOfManyCamerasSeeWithinSomeSets) {
  std::mt19937 random(9);
  const Rig rig = ring(40);
  const auto markers = cloud(8, random);
  auto world = see(rig, markers, {.sigma_px = 0.1}, random);
  for (std::size_t c = 0; c < rig.size(); ++c) {
    if (c != 3 && c != 11 && c != 30) world.frames[c]->blobs.clear();
  }
  const auto matcher = make_matcher({}, rig);

  std::size_t found = 0;
  for (int set = 0; set < 4; ++set) found = std::max(found, matcher->match(world.set, {}).matches.size());

  EXPECT_EQ(found, 8u);
}

TEST(MultiViewMatcher, FindsNewMarkersAmongFewRaysThatLieOffTheirEpipolarLines) {
  // Blobs with an error of 0.8 px lie about 1 px from the epipolar lines.
  std::mt19937 random(23);
  const Rig rig{camera_at({4.0, 0.0, 2.5}), camera_at({0.0, 4.0, 2.5})};
  const std::vector<Vector3d> markers{
      {0.1, 0.0, 0.3}, {-0.1, 0.1, 0.7}, {0.0, -0.1, 1.1}, {0.2, 0.2, 1.5}, {0.0, 0.0, 1.9}};
  const SeenWorld world = see(rig, markers, {.sigma_px = 0.8, .missed = 0.0}, random);

  const auto matcher = make_matcher({}, rig);
  const Matches& matches = matcher->match(world.set, {});

  EXPECT_EQ(score(world, matches).found.size(), markers.size());
}

TEST(MultiViewMatcher, RefusesMarkersOutsideTheVolume) {
  std::mt19937 random(4);
  const Rig rig = ring(6);
  const std::vector<Vector3d> markers{{0.0, 0.0, 0.5}, {0.0, 0.0, 1.6}};
  const auto world = see(rig, markers, {.sigma_px = 0.05}, random);
  MatchSettings settings;
  settings.volume_max_m.z() = 1.0;

  EXPECT_EQ(make_matcher(settings, rig)->match(world.set, {}).matches.size(), 1u);
  EXPECT_EQ(make_matcher(settings, rig)->match(world.set, expect(markers, 0.005, random)).matches.size(), 1u);
}

TEST(MultiViewMatcher, BoundsItsWorkInViewsFullOfClutterAndCountsTheSkippedHypotheses) {
  std::mt19937 random(4);
  const Rig rig = ring(64);
  const auto world = see(rig, cloud(10, random), {.false_blobs = 60.0}, random);
  Predictions predicted = expect(cloud(kMaxMarkers, random), 0.02, random);
  predicted.markers[3].position.v.x() = std::numeric_limits<double>::quiet_NaN();
  predicted.markers[4].covariance_m2.setConstant(std::numeric_limits<double>::infinity());
  const auto matcher = make_matcher({}, rig);

  EXPECT_GT(matcher->match(world.set, {}).skipped, 0u);
  EXPECT_LE(matcher->match(world.set, predicted).matches.size(), kMaxMarkers);
}

TEST(MultiViewMatcher, IgnoresBlobsThatAreNotFinite) {
  std::mt19937 random(4);
  const Rig rig = ring(3);
  const std::vector<Vector3d> markers{{0.0, 0.0, 0.5}};
  auto world = see(rig, markers, {}, random);
  Blob nonsense;
  nonsense.centroid.v.setConstant(std::numeric_limits<double>::quiet_NaN());
  world.frames[0]->blobs.push_back(nonsense);
  nonsense.centroid.v.setConstant(1e9);
  world.frames[1]->blobs.push_back(nonsense);
  nonsense = world.frames[2]->blobs[0];
  nonsense.sigma_px = 0.0;
  world.frames[2]->blobs[0] = nonsense;

  EXPECT_EQ(make_matcher({}, rig)->match(world.set, {}).matches.size(), 1u);
}

TEST(MultiViewMatcher, FindsNothingInEmptyViews) {
  const Rig rig = ring(2);
  const auto matcher = make_matcher({}, rig);

  EXPECT_EQ(matcher->match(FrameSet{}, {}).matches.size(), 0u);
}

/// Four stationary markers; the 2D track of each blob is the number of its marker. The matcher has learned the
/// identities.
struct TrackedScene {
  TrackedScene() {
    for (int set = 0; set < 5; ++set) {
      auto world = look();
      const Matches& matches = matcher.match(world.set, predicted().markers);
      EXPECT_EQ(matches.matches.size(), markers.size());
    }
  }
  SeenWorld look() {
    auto world = see(rig, markers, {.sigma_px = 0.05}, random);
    for (std::size_t view = 0; view < rig.size(); ++view) {
      Blobs& blobs = world.frames[view]->blobs;
      for (std::size_t b = 0; b < blobs.size(); ++b) {
        blobs[b].track = BlobTrackId{static_cast<std::uint32_t>(world.marker_of[view][b])};
      }
    }
    return world;
  }
  Predictions predicted(double sigma_m = 0.005) {
    Predictions all = expect(markers, 0.001, random);
    for (PredictedMarker& marker : all.markers) marker.covariance_m2 = Eigen::Matrix3d::Identity() * sigma_m * sigma_m;
    return all;
  }

  std::mt19937 random{4};
  Rig rig = ring(4);
  std::vector<Vector3d> markers{{0.0, 0.0, 1.0}, {0.4, 0.1, 1.2}, {-0.3, 0.3, 0.8}, {0.2, -0.4, 1.4}};
  IdentifiedMatcher matcher{rig};
};

const Match* match_of(const Matches& matches, std::uint32_t predicted) {
  const auto found = std::ranges::find(matches.matches, predicted, &Match::prediction);
  return found == matches.matches.end() ? nullptr : &*found;
}

TEST(MultiViewMatcher, RefusesAPairIfTheTrackOfOneBlobBelongsToAnotherMarker) {
  TrackedScene tracked;
  auto world = tracked.look();
  // Camera 0 sees the first marker. Camera 1 sees the second marker where the first would be. The others see neither.
  const Vector3d between = tracked.markers[0] + Vector3d(0.004, 0.0, 0.0);
  world.frames[0]->blobs[0].centroid = *geometry::project(tracked.rig[0], {between});
  world.frames[1]->blobs[0].centroid = *geometry::project(tracked.rig[1], {between});
  world.frames[1]->blobs[0].track = BlobTrackId{1};
  world.frames[1]->blobs.erase_unordered(1);
  for (const std::size_t view : {2u, 3u}) {
    world.frames[view]->blobs.erase_unordered(1);
    world.frames[view]->blobs.erase_unordered(0);
  }

  const Matches& matches = tracked.matcher.match(world.set, tracked.predicted().markers);

  EXPECT_EQ(match_of(matches, 0), nullptr);
  ASSERT_GE(matches.bearing_only.size(), 1u);
  EXPECT_EQ(matches.bearing_only[0].prediction, 0u);
  EXPECT_EQ(matches.bearing_only[0].sighting.view, 0u);
}

TEST(MultiViewMatcher, RefusesAChancePairInTheGateOfAnUncertainMarker) {
  std::mt19937 random(4);
  const Rig rig = ring(8);
  const auto markers = cloud(40, random);
  auto world = see(rig, markers, {.sigma_px = 0.05, .false_blobs = 1.0}, random);
  const auto matcher = make_matcher({}, rig);
  Predictions predicted = expect(markers, 0.001, random);
  // One more marker, predicted to 100 mm, that no camera sees. The rays of two false blobs meet 200 mm from the marker.
  PredictedMarker lost;
  lost.position.v = {0.0, 0.0, 1.0};
  lost.covariance_m2 = Eigen::Matrix3d::Identity() * 0.01;
  lost.track = TrackId{90};
  predicted.markers.push_back(lost);
  const WorldPoint triangulation{{0.16, 0.1, 1.08}};
  for (const std::size_t view : {0u, 2u}) {
    Blob blob = world.frames[view]->blobs[0];
    blob.centroid = *geometry::project(rig[view], triangulation);
    world.frames[view]->blobs.push_back(blob);
  }

  EXPECT_EQ(match_of(matcher->match(world.set, predicted), 40), nullptr);

  // The same two blobs are accepted if the marker is predicted at their intersection.
  predicted.markers[40].position = triangulation;
  predicted.markers[40].covariance_m2 = Eigen::Matrix3d::Identity() * 25e-6;
  EXPECT_NE(match_of(matcher->match(world.set, predicted), 40), nullptr);
}

TEST(MultiViewMatcher, FindsAMarkerThatJumpedOutOfItsGateByIts2DTracks) {
  TrackedScene tracked;
  const Predictions predicted = tracked.predicted();
  tracked.markers[0] += Vector3d(0.1, -0.08, 0.1);
  auto world = tracked.look();

  const Match* match = match_of(tracked.matcher.match(world.set, predicted.markers), 0);

  ASSERT_NE(match, nullptr);
  EXPECT_EQ(match->sightings.size(), 4u);
  EXPECT_TRUE(match->by_blob_tracks);
}

TEST(MultiViewMatcher, MergesTwoTracksOfOneMarkerIntoTheOlder) {
  std::mt19937 random(4);
  const Rig rig = ring(8);
  const std::vector<Vector3d> markers{{0.0, 0.0, 1.0}, {0.4, 0.1, 1.2}, {-0.3, 0.3, 0.8}};
  auto world = see(rig, markers, {.sigma_px = 0.05}, random);
  const auto matcher = make_matcher({}, rig);
  Predictions predicted = expect(markers, 0.0005, random);
  PredictedMarker twin = predicted.markers[0];
  twin.position.v += Vector3d(0.002, 0.001, 0.0);
  twin.track = TrackId{99};
  predicted.markers.push_back(twin);

  const Matches& matches = matcher->match(world.set, predicted);

  const Match* match = match_of(matches, 0);
  ASSERT_NE(match, nullptr);
  EXPECT_EQ(match->sightings.size(), 8u);
  EXPECT_EQ(match_of(matches, 3), nullptr);
  EXPECT_EQ(matches.matches.size(), 3u);
}

}  // namespace multi_view_matcher_test
}  // namespace mocap::associate
