#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "associate/identified_matcher.h"
#include "support/marker_world.h"

namespace mocap::associate {
namespace single_view_association_test {

using Eigen::Vector3d;
using namespace mocap::test;

constexpr SubjectId kSubject{0};

/// The markers of a hand; each blob has a 2D track. In the images of hide(), camera 0 sees only the first marker, and
/// the other cameras see nothing.
struct Hand {
  Hand() {
    for (int set = 0; set < 5; ++set) (void)matcher.match(look().set, predicted(0.005));
  }
  SeenWorld look() {
    auto world = see(rig, markers, {.sigma_px = 0.05}, random);
    for (std::size_t view = 0; view < rig.size(); ++view) {
      Blobs& blobs = world.frames[view]->blobs;
      for (std::size_t b = 0; b < blobs.size(); ++b)
        blobs[b].track = BlobTrackId{static_cast<std::uint32_t>(world.marker_of[view][b])};
    }
    return world;
  }
  SeenWorld hide() {
    auto world = look();
    for (std::size_t view = 0; view < rig.size(); ++view) {
      Blobs& blobs = world.frames[view]->blobs;
      for (std::size_t b = blobs.size(); b-- > 0;) {
        if (view != 0 || world.marker_of[view][b] != 0) blobs.erase_unordered(b);
      }
    }
    return world;
  }
  /// As hide(), but the 2D track broke: the blob has another 2D track.
  SeenWorld hide_and_break() {
    auto world = hide();
    EXPECT_EQ(matcher.match(world.set, predicted(0.005)).bearing_only.size(), 1U);
    world.frames[0]->blobs[0].track = BlobTrackId{77};
    return world;
  }
  /// Predictions of all markers with a common offset. With as_another(), the third marker is predicted where the first
  /// is.
  PredictedMarkers predicted(double sigma_m, const Vector3d& off = Vector3d::Zero(), bool tracked = true) {
    PredictedMarkers all;
    for (std::uint32_t m = 0; m < markers.size(); ++m) {
      PredictedMarker& marker = all.push_back({});
      marker.position.v = markers[m] + off;
      marker.covariance_m2 = sigma_m * sigma_m * Eigen::Matrix3d::Identity();
      marker.label = {kSubject, m};
      if (tracked) marker.track = TrackId{40 + m};
    }
    return all;
  }
  Vector3d as_another() const { return markers[0] - markers[2]; }

  std::mt19937 random{4};
  Rig rig = ring(4);
  std::vector<Vector3d> markers{{0.0, 0.0, 1.0}, {0.06, 0.02, 1.0}, {0.02, 0.07, 1.02}};
  IdentifiedMatcher matcher{rig};
};

TEST(SingleViewAssociation, PrefersTheMarkerOfThe2DTrackToAnotherMarkerPredictedAtTheBlob) {
  Hand hand;
  const auto world = hand.hide();

  const Matches& matches = hand.matcher.match(world.set, hand.predicted(0.04, hand.as_another()));

  ASSERT_EQ(matches.bearing_only.size(), 1U);
  EXPECT_EQ(matches.bearing_only[0].prediction, 0U);
}

TEST(SingleViewAssociation, FindsAMarkerByItsLabelAfterIts3DTrackEnded) {
  Hand hand;
  const auto world = hand.hide();

  const Matches& matches = hand.matcher.match(world.set, hand.predicted(0.04, hand.as_another(), false));

  ASSERT_EQ(matches.bearing_only.size(), 1U);
  EXPECT_EQ(matches.bearing_only[0].prediction, 0U);
}

TEST(SingleViewAssociation, KeepsTheMarkerOfAnUnambiguousBearing) {
  Hand hand;
  auto world = hand.hide();
  world.frames[0]->blobs[0].track = BlobTrackId{77};  // a new 2D track
  for (int set = 0; set < 4; ++set) {
    ASSERT_EQ(hand.matcher.match(world.set, hand.predicted(0.003)).bearing_only.size(), 1U);
  }

  const Matches& matches = hand.matcher.match(world.set, hand.predicted(0.04, hand.as_another(), false));

  ASSERT_EQ(matches.bearing_only.size(), 1U);
  EXPECT_EQ(matches.bearing_only[0].prediction, 0U);
}

// Another camera has a blob on the ray of the first camera, three standard deviations from the predicted depth. A flash
// has no 2D track; a marker that enters the view of that camera gets a 2D track within a few images.
TEST(SingleViewAssociation, RefusesAFlashAsTheSecondViewOfABearingOnlyMarker) {
  for (const bool flashes : {true, false}) {
    Hand hand;
    (void)hand.matcher.match(hand.hide().set, hand.predicted(0.005));
    auto world = hand.hide();
    const Vector3d away = (hand.markers[0] - hand.rig[0].centre().v).normalized();
    Hand farther;
    farther.markers[0] += 0.03 * away;
    const auto other = farther.look();
    for (std::size_t b = 0; b < other.frames[1]->blobs.size(); ++b) {
      if (other.marker_of[1][b] != 0) continue;
      Blob& blob = world.frames[1]->blobs.push_back(other.frames[1]->blobs[b]);
      blob.track = flashes ? BlobTrackId{} : BlobTrackId{88};
    }
    ASSERT_EQ(world.frames[1]->blobs.size(), 1U);

    const Matches& matches = hand.matcher.match(world.set, hand.predicted(0.01));

    EXPECT_EQ(matches.bearing_only.size(), flashes ? 1U : 0U);
    EXPECT_EQ(matches.matches.size(), flashes ? 0U : 1U);
  }
}

// The 2D track breaks, and the next blob is a little nearer to the prediction of an unobserved marker.
TEST(SingleViewAssociation, ContinuesABearingAfterIts2DTrackBroke) {
  Hand hand;
  const auto world = hand.hide_and_break();

  const Matches& matches = hand.matcher.match(world.set, hand.predicted(0.04, 0.6 * hand.as_another(), false));

  ASSERT_EQ(matches.bearing_only.size(), 1U);
  EXPECT_EQ(matches.bearing_only[0].prediction, 0U);
}

TEST(SingleViewAssociation, ForgetsABrokenTrackAfter24Images) {
  Hand hand;
  const auto world = hand.hide_and_break();
  auto dark = hand.hide();
  dark.frames[0]->blobs.clear();
  for (int set = 0; set < 30; ++set) (void)hand.matcher.match(dark.set, hand.predicted(0.005));

  const Matches& matches = hand.matcher.match(world.set, hand.predicted(0.04, 0.6 * hand.as_another(), false));

  ASSERT_EQ(matches.bearing_only.size(), 1U);
  EXPECT_EQ(matches.bearing_only[0].prediction, 2U);
}

TEST(SingleViewAssociation, LearnsNoIdentityFromAnAmbiguousBearing) {
  Hand hand;
  auto world = hand.hide();
  world.frames[0]->blobs[0].track = BlobTrackId{77};
  // The blob may belong to any of the three markers; the first marker is a little nearer.
  for (int set = 0; set < 4; ++set) (void)hand.matcher.match(world.set, hand.predicted(0.1, Vector3d::Zero(), false));

  const Matches& matches = hand.matcher.match(world.set, hand.predicted(0.04, hand.as_another(), false));

  ASSERT_EQ(matches.bearing_only.size(), 1U);
  EXPECT_EQ(matches.bearing_only[0].prediction, 2U);
}

// The distance of the ray from a position.
double off_m(const BearingOnlyObservation& bearing_only, const Vector3d& place) {
  return (place - bearing_only.eye.v).cross(bearing_only.direction).norm();
}

TEST(SingleViewAssociation, ShiftsAnAmbiguousBearingToTheMeanOfItsMarkers) {
  Hand hand;
  auto world = hand.hide();
  world.frames[0]->blobs[0].track = BlobTrackId{77};
  const Vector3d middle = (hand.markers[0] + hand.markers[1] + hand.markers[2]) / 3.0;

  // All three markers are possible: the bearing is shifted as if the blob were the mean of the markers.
  const Matches& matches = hand.matcher.match(world.set, hand.predicted(0.1, Vector3d::Zero(), false));

  ASSERT_EQ(matches.bearing_only.size(), 1U);
  const BearingOnlyObservation& bearing_only = matches.bearing_only[0];
  const Vector3d& marker = hand.markers[bearing_only.prediction];
  EXPECT_LT(off_m(bearing_only, hand.markers[0] + marker - middle), 0.005);
  const double sigma_m = bearing_only.sigma_rad * (marker - bearing_only.eye.v).norm();
  EXPECT_GT(sigma_m, 0.02);
  EXPECT_LT(sigma_m, 0.05);
}

TEST(SingleViewAssociation, DoesNotShiftTheBearingOfAWellKnownMarker) {
  Hand hand;
  auto world = hand.hide();
  world.frames[0]->blobs[0].track = BlobTrackId{77};

  // Several markers are possible, but the position of each is too certain for the blob of another marker.
  const Matches& matches = hand.matcher.match(world.set, hand.predicted(0.015, 0.45 * hand.as_another(), false));

  ASSERT_EQ(matches.bearing_only.size(), 1U);
  EXPECT_LT(off_m(matches.bearing_only[0], hand.markers[0]), 0.001);
}

}  // namespace single_view_association_test
}  // namespace mocap::associate
