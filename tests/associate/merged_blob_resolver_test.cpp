#include "associate/predicted/merged_blob_resolver.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "associate/match_triangulator.h"
#include "associate/multi_view_matcher.h"
#include "support/marker_world.h"

namespace mocap::associate {
namespace merged_blob_resolver_test {

using namespace mocap::test;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// The blob that a detector finds for two discs of 15 px^2 side by side.
Blob merged(const Vector2d& a_px, const Vector2d& b_px) {
  constexpr double kRadius2_px2 = 15.0 / std::numbers::pi;
  const Vector2d along = 0.5 * (a_px - b_px);
  Blob blob;
  blob.centroid.v = 0.5 * (a_px + b_px);
  blob.sigma_px = 0.02;
  blob.area_px2 = 30.0;
  blob.roundness = std::sqrt(kRadius2_px2 / (kRadius2_px2 + 4.0 * along.squaredNorm()));
  blob.axis_rad = std::atan2(along.y(), along.x());
  return blob;
}

/// Several markers. Two of them are close to each other and form one blob in some views.
struct CloseMarkers {
  explicit CloseMarkers(std::span<const std::size_t> merged_views) {
    world = see(rig, markers, {.sigma_px = 0.02}, random);
    for (auto& frame : world.frames) {
      for (Blob& blob : frame->blobs) {
        blob.area_px2 = 15.0;
        blob.roundness = 0.9;
      }
    }
    for (const std::size_t view : merged_views) {
      Blobs& blobs = world.frames[view]->blobs;
      const Blob both = merged(blobs[0].centroid.v, blobs[1].centroid.v);
      blobs.erase_unordered(1);
      blobs[0] = both;
    }
  }

  std::mt19937 random{7};
  Rig rig = ring(4);
  // The first two are 4 to 5 px apart in each view.
  std::vector<Vector3d> markers{
      {0.0, 0.0, 1.0}, {0.004, 0.004, 1.0185}, {0.4, 0.1, 1.2}, {-0.3, 0.2, 0.6}, {0.1, -0.4, 0.3}};
  SeenWorld world;
};

const Match* match_of(const Matches& matches, std::uint32_t predicted) {
  const auto found = std::ranges::find(matches.matches, predicted, &Match::prediction);
  return found == matches.matches.end() ? nullptr : found;
}

TEST(MergedBlobResolver, AssignsAMergedBlobToBothOfItsMarkers) {
  const std::vector<std::size_t> one_view{1};
  CloseMarkers close(one_view);
  const auto predicted = expect(close.markers, 0.001, close.random);
  const auto matcher = make_matcher({}, close.rig);

  const Matches& matches = matcher->match(close.world.set, predicted);

  for (const std::uint32_t m : {0u, 1u}) {
    const Match* match = match_of(matches, m);
    ASSERT_NE(match, nullptr);
    ASSERT_EQ(match->sightings.size(), 4u);
    const BlobRef& shared = match->sightings[1];
    const Vector2d place =
        close.world.frames[1]->blobs[shared.blob].centroid.v + Vector2d(shared.off_x_px, shared.off_y_px);
    const auto truth = geometry::project(close.rig[1], {close.markers[m]});
    EXPECT_LT((place - truth->v).norm(), 0.7)
        << m;  // px; the spread is 2.2 px, and its model was fitted to rendered discs, not to this ideal blob
    EXPECT_GT(shared.sigma_px, 0.2F);
  }
  EXPECT_EQ(matches.unmatched_blobs, 0u);
}

TEST(MergedBlobResolver, KeepsBothMarkersInPlaceIfHalfOfTheViewsMergeThem) {
  const std::vector<std::size_t> two_views{0, 2};
  CloseMarkers close(two_views);
  const auto predicted = expect(close.markers, 0.002, close.random);
  const auto matcher = make_matcher({}, close.rig);
  const auto triangulator = make_triangulator({}, close.rig);

  const Markers& markers = triangulator->triangulate(close.world.set, matcher->match(close.world.set, predicted));

  ASSERT_EQ(markers.size(), close.markers.size());
  for (const Marker& marker : markers) {
    EXPECT_LT((marker.position.v - close.markers[marker.prediction]).norm(), 0.001) << marker.prediction;
    EXPECT_EQ(marker.cameras, 4u);
  }
}

TEST(MergedBlobResolver, RemovesASecondTrackThatSharesAllBlobsOfAMarker) {
  CloseMarkers close({});
  Predictions predicted = expect(close.markers, 0.001, close.random);
  PredictedMarker twin = predicted.markers[2];
  twin.position.v.x() += 0.0008;
  twin.track = TrackId{99};
  predicted.markers.push_back(twin);
  const auto matcher = make_matcher({}, close.rig);

  const Matches& matches = matcher->match(close.world.set, predicted);

  EXPECT_EQ(matches.matches.size(), close.markers.size());
  ASSERT_NE(match_of(matches, 2), nullptr);
  EXPECT_EQ(match_of(matches, 2)->sightings.size(), 4u);
  EXPECT_EQ(match_of(matches, 5), nullptr);
}

TEST(MergedBlobResolver, SharesNoBlobWhoseShapeDoesNotFit) {
  // One marker is merged with clutter. The other marker is hidden and farther away than the shape of the blob allows.
  ViewRays view;
  const CameraModel camera = camera_at({4.0, 0.0, 1.0});
  view.camera = &camera;
  view.focal_px = 900.0;
  view.rays.resize(1);
  view.rays.x = {0.0};
  view.rays.y = {0.0};
  view.sigma_px = {1.0};
  view.spread_px = {1.0};
  view.axis_rad = {0.0};
  const double px = 1.0 / view.focal_px;
  view.index();
  RayBins bins;
  bins.fill(view.places(), view.bounds(), view.typical_variance(), 4.0F);
  // Two markers on either side of the blob, each with a standard deviation of 0.3 px.
  const auto two_at = [&](const Vector2d& off_px) {
    PredictedMeasurements two;
    two.resize(2);
    for (const std::size_t m : {0U, 1U}) {
      const Vector2d at = (m == 0 ? 1.0 : -1.0) * px * off_px;
      two.x[m] = static_cast<float>(at.x());
      two.y[m] = static_cast<float>(at.y());
      two.xx[m] = two.yy[m] = static_cast<float>(0.09 * px * px);
      two.depth_m[m] = 4.0F;
    }
    return two;
  };
  const PredictedMeasurements along = two_at({1.0, 0.0});
  const PredictedMeasurements across = two_at({0.0, 1.6});
  MergedBlobResolver sharer(8);

  for (const auto& [predicted, shared] : {std::pair{along, true}, std::pair{across, false}}) {
    RayAssignments assigned(2);
    assigned.begin(2, 1);
    assigned.assign(0, 0);
    sharer.resolve(view, bins, predicted, assigned);
    EXPECT_EQ(assigned.rays()[1] == 0, shared);
  }
}

}  // namespace merged_blob_resolver_test
}  // namespace mocap::associate
