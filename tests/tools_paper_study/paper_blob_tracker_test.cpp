#include "paper_study/paper_blob_tracker.h"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

namespace mocap::paper_study {
namespace paper_blob_tracker_test {

using Points = std::vector<Eigen::Vector2d>;

std::unique_ptr<BlobFrame> frame_of(const Points& points, int number) {
  auto frame = std::make_unique<BlobFrame>();
  frame->exposed_at = from_ns(number * 33'000'000LL);
  for (const Eigen::Vector2d& point : points) {
    Blob blob;
    blob.centroid.v = point;
    frame->blobs.push_back(blob);
  }
  return frame;
}

std::vector<std::uint32_t> tracks_of(BlobTracker& tracker, const Points& points, int number) {
  auto frame = frame_of(points, number);
  tracker.track(*frame);
  std::vector<std::uint32_t> tracks;
  for (const Blob& blob : frame->blobs) tracks.push_back(blob.track.value);
  return tracks;
}

constexpr std::uint32_t kNone = BlobTrackId::kNothing;

TEST(PaperBlobTracker, AssignsLabelsOnlyInTheFirstFrameWithBlobs) {
  for (const track2d::TrackMethod method :
       {track2d::TrackMethod::AlphaBeta, track2d::TrackMethod::Kalman, track2d::TrackMethod::Condensation}) {
    const auto tracker = paper_study::make_paper_blob_tracker({.method = method});
    EXPECT_TRUE(tracks_of(*tracker, {}, 0).empty());
    EXPECT_EQ(tracks_of(*tracker, {{100.0, 100.0}}, 1), (std::vector<std::uint32_t>{0}));
    EXPECT_EQ(tracks_of(*tracker, {{400.0, 400.0}, {103.0, 100.0}}, 2), (std::vector<std::uint32_t>{kNone, 0}));
  }
}

TEST(PaperBlobTracker, AssignsTheNearestBlobToTheFirstLabelEvenIfAnotherAssignmentIsBetter) {
  const auto tracker = paper_study::make_paper_blob_tracker({.method = track2d::TrackMethod::AlphaBeta});
  tracks_of(*tracker, {{100.0, 100.0}, {130.0, 100.0}}, 0);

  // The blob of the second label is closer to the first label than the blob of the first label.
  EXPECT_EQ(tracks_of(*tracker, {{80.0, 100.0}, {116.0, 100.0}}, 1), (std::vector<std::uint32_t>{kNone, 0}));
}

TEST(PaperBlobTracker, FindsALabelAtItsPredictionAfterAnyTimeHidden) {
  const auto tracker = paper_study::make_paper_blob_tracker({.method = track2d::TrackMethod::AlphaBeta});
  tracks_of(*tracker, {{100.0, 100.0}}, 0);
  int k = 1;
  for (; k <= 10; ++k) tracks_of(*tracker, {{100.0 + 5.0 * k, 100.0}}, k);
  for (; k <= 60; ++k) tracks_of(*tracker, {}, k);

  EXPECT_EQ(tracks_of(*tracker, {{100.0 + 5.0 * k, 110.0}}, k), (std::vector<std::uint32_t>{0}));
}

TEST(PaperBlobTracker, AssignsNoBlobOutsideTheGate) {
  const auto tracker = paper_study::make_paper_blob_tracker({.method = track2d::TrackMethod::AlphaBeta});
  tracks_of(*tracker, {{100.0, 100.0}}, 0);
  EXPECT_EQ(tracks_of(*tracker, {{140.0, 100.0}}, 1), (std::vector<std::uint32_t>{kNone}));
  EXPECT_EQ(tracks_of(*tracker, {{139.9, 100.0}}, 2), (std::vector<std::uint32_t>{0}));
}

TEST(PaperBlobTracker, PredictsTheNextFrameWithoutAChangeOfState) {
  for (const track2d::TrackMethod method :
       {track2d::TrackMethod::AlphaBeta, track2d::TrackMethod::Kalman, track2d::TrackMethod::Condensation}) {
    const auto tracker = paper_study::make_paper_blob_tracker({.method = method});
    const auto* inspection = dynamic_cast<const track2d::BlobTrackInspection*>(tracker.get());
    ASSERT_NE(inspection, nullptr);
    tracks_of(*tracker, {{100.0, 100.0}}, 0);
    for (int k = 1; k < 10; ++k) tracks_of(*tracker, {{100.0 + 4.0 * k, 100.0}}, k);
    std::vector<track2d::BlobTrackBelief> ahead, again;
    inspection->predict_tracks(from_ns(10 * 33'000'000LL), ahead);
    inspection->predict_tracks(from_ns(10 * 33'000'000LL), again);

    ASSERT_EQ(ahead.size(), 1U);
    EXPECT_EQ(ahead[0].point.v, again[0].point.v);  // the prediction changed no state
    const Eigen::Vector2d edge = ahead[0].point.v + Eigen::Vector2d(ahead[0].gate_radius_px, 0.0);
    const auto copy_of_what_follows = tracks_of(*tracker, {edge + Eigen::Vector2d(1e-6, 0.0)}, 10);
    EXPECT_EQ(copy_of_what_follows, (std::vector<std::uint32_t>{kNone}));
  }
}

}  // namespace paper_blob_tracker_test
}  // namespace mocap::paper_study
