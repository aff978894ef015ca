#include "track2d/following_blob_tracker.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>
#include <string>
#include <vector>

namespace mocap::track2d {
namespace following_blob_tracker_test {

constexpr double kRate_hz = 60.0;

BlobFrame frame_of(int image, const std::vector<Eigen::Vector2d>& points) {
  BlobFrame frame;
  frame.exposed_at = from_ns(1) + from_s(image / kRate_hz);
  for (const Eigen::Vector2d& point : points) {
    Blob blob;
    blob.centroid = {point};
    blob.sigma_px = 0.05;
    frame.blobs.push_back(blob);
  }
  return frame;
}

class EveryMethod : public testing::TestWithParam<TrackMethod> {
 protected:
  static std::unique_ptr<BlobTracker> tracker() {
    TrackBlobsSettings settings;
    settings.method = GetParam();
    return make_blob_tracker(settings);
  }
};

TEST_P(EveryMethod, GivesAnIdToABlobThatWasDetectedThreeTimes) {
  const auto tracker = EveryMethod::tracker();
  for (int image = 0; image < 5; ++image) {
    BlobFrame frame = frame_of(image, {{100.0 + 3.0 * image, 50.0}});
    tracker->track(frame);
    EXPECT_EQ(frame.blobs[0].track.names_something(), image >= 2) << "image " << image;
  }
}

TEST_P(EveryMethod, KeepsTheIdsOfThirtyMarkersWhoseBlobsComeInAnyOrder) {
  const auto tracker = EveryMethod::tracker();
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.05);
  std::vector<BlobTrackId> ids(30);
  int changes = 0;
  for (int image = 0; image < 200; ++image) {
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < 30; ++i) order.insert(order.begin() + static_cast<int>(random() % (i + 1)), i);
    std::vector<Eigen::Vector2d> points;
    for (const std::size_t i : order) {
      const double phase = 0.04 * image + 0.7 * static_cast<double>(i);
      const Eigen::Vector2d centre(60.0 + 100.0 * static_cast<double>(i % 6), 50.0 + 90.0 * static_cast<double>(i / 6));
      points.push_back(centre + 35.0 * Eigen::Vector2d(std::cos(phase), std::sin(1.3 * phase)) +
                       Eigen::Vector2d(noise(random), noise(random)));
    }
    BlobFrame frame = frame_of(image, points);

    tracker->track(frame);

    for (std::size_t b = 0; b < order.size(); ++b) {
      BlobTrackId& known = ids[order[b]];
      if (image >= 5 && known != frame.blobs[b].track) ++changes;
      known = frame.blobs[b].track;
      EXPECT_TRUE(image < 5 || known.names_something());
    }
  }
  EXPECT_EQ(changes, 0);
}

TEST_P(EveryMethod, KeepsTheIdOfAMarkerThatPassesBehindABarrier) {
  const auto tracker = EveryMethod::tracker();
  BlobTrackId before;
  for (int image = 0; image < 40; ++image) {
    const bool hidden = image >= 25 && image < 31;
    std::vector<Eigen::Vector2d> points{{500.0, 400.0}};
    if (!hidden) points.push_back({50.0 + 4.0 * image, 100.0});
    BlobFrame frame = frame_of(image, points);
    tracker->track(frame);
    if (image == 24) before = frame.blobs[1].track;
    if (image < 31) continue;
    EXPECT_EQ(frame.blobs[1].track, before) << "image " << image;
  }
}

TEST_P(EveryMethod, NeverGivesOneIdTwiceOrTheIdOfATrackThatEnded) {
  TrackBlobsSettings settings;
  settings.method = GetParam();
  settings.max_coast = std::chrono::milliseconds(250);
  const auto tracker = make_blob_tracker(settings);
  std::set<std::uint32_t> ended;
  for (int scene = 0; scene < 20; ++scene) {
    std::mt19937 place(static_cast<unsigned>(scene));
    std::vector<Eigen::Vector2d> points;
    for (int i = 0; i < 20; ++i) {
      points.push_back({static_cast<double>(place() % 640), static_cast<double>(place() % 480)});
    }
    std::set<std::uint32_t> now;
    for (int image = 0; image < 10; ++image) {
      // One second between two scenes: longer than a track coasts.
      BlobFrame frame = frame_of(70 * scene + image, points);
      tracker->track(frame);
      now.clear();
      for (const Blob& blob : frame.blobs) {
        if (!blob.track.names_something()) continue;
        EXPECT_TRUE(now.insert(blob.track.value).second) << "twice in one image";
        EXPECT_EQ(ended.count(blob.track.value), 0U);
      }
    }
    EXPECT_GE(now.size(), 15U);
    ended.insert(now.begin(), now.end());
  }
}

TEST_P(EveryMethod, SurvivesFullFramesAndFramesOutOfOrder) {
  const auto tracker = EveryMethod::tracker();
  std::mt19937 random(2);
  for (int image = 0; image < 12; ++image) {
    std::vector<Eigen::Vector2d> points;
    for (std::size_t i = 0; i < kMaxBlobs; ++i) {
      points.push_back({static_cast<double>(random() % 640), static_cast<double>(random() % 480)});
    }
    points[3].x() = std::nan("");
    BlobFrame frame = frame_of(image == 7 ? 2 : image, points);
    tracker->track(frame);
    EXPECT_FALSE(frame.blobs[3].track.names_something());
  }
}

INSTANTIATE_TEST_SUITE_P(TrackBlobs, EveryMethod,
                         testing::Values(TrackMethod::AlphaBeta, TrackMethod::AdaptiveAlphaBeta, TrackMethod::Kalman,
                                         TrackMethod::Condensation),
                         [](const auto& method) {
                           switch (method.param) {
                             case TrackMethod::AlphaBeta: return std::string("AlphaBeta");
                             case TrackMethod::AdaptiveAlphaBeta: return std::string("AdaptiveAlphaBeta");
                             case TrackMethod::Kalman: return std::string("Kalman");
                             case TrackMethod::Condensation: return std::string("Condensation");
                           }
                           return std::string();
                         });

TEST(TrackBlobs, KeepsTheIdsOfTwoMarkersThatCross) {
  const auto tracker = make_blob_tracker({});
  BlobTrackId first;
  BlobTrackId second;
  for (int image = 0; image < 40; ++image) {
    const double t = image - 20.0;
    BlobFrame frame = frame_of(image, {{320.0 + 6.0 * t, 200.0 + 2.0 * t}, {320.0 - 6.0 * t, 203.0 + 2.0 * t}});
    tracker->track(frame);
    if (image == 5) {
      first = frame.blobs[0].track;
      second = frame.blobs[1].track;
    }
    if (image < 5) continue;
    EXPECT_EQ(frame.blobs[0].track, first) << "image " << image;
    EXPECT_EQ(frame.blobs[1].track, second) << "image " << image;
  }
}

}  // namespace following_blob_tracker_test
}  // namespace mocap::track2d
