// Markers with a radius of 7 px whose discs overlap in the image, at 30 Hz.
#include "track2d/blob_pair.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <vector>

#include "track2d/blob_track_inspection.h"
#include "track2d/following_blob_tracker.h"

namespace mocap::track2d {
namespace blob_pair_test {

using Point = Eigen::Vector2d;
using Path = std::function<Point(double image)>;
using Hidden = std::function<bool(const Point&)>;

constexpr double kRadius_px = 7.0;
constexpr double kRate_hz = 30.0;

/// The blob of the visible part of some discs, by counting points at a distance of 0.2 px.
Blob blob_of(const std::vector<Point>& discs, const Hidden& hidden) {
  constexpr double kStep = 0.2;
  Point low = discs.front();
  Point high = low;
  for (const Point& disc : discs) {
    low = low.cwiseMin(disc);
    high = high.cwiseMax(disc);
  }
  double n = 0.0, xx = 0.0, yy = 0.0, xy = 0.0;
  Point sum = Point::Zero();
  for (double y = low.y() - 8.0; y < high.y() + 8.0; y += kStep) {
    for (double x = low.x() - 8.0; x < high.x() + 8.0; x += kStep) {
      const Point at(x, y);
      bool lit = false;
      for (const Point& disc : discs) lit = lit || (at - disc).squaredNorm() < kRadius_px * kRadius_px;
      if (!lit || (hidden && hidden(at))) continue;
      n += 1.0;
      sum += at;
      xx += x * x;
      yy += y * y;
      xy += x * y;
    }
  }
  Blob blob;
  blob.sigma_px = 0.05;
  blob.area_px2 = n * kStep * kStep;
  if (n == 0.0) return blob;
  const Point mean = sum / n;
  blob.centroid = {mean};
  const double vx = xx / n - mean.x() * mean.x();
  const double vy = yy / n - mean.y() * mean.y();
  const double c = xy / n - mean.x() * mean.y();
  const double range = std::hypot(0.5 * (vx - vy), c);
  blob.roundness = std::sqrt(std::max(0.0, 0.5 * (vx + vy) - range) / (0.5 * (vx + vy) + range));
  blob.axis_rad = 0.5 * std::atan2(2.0 * c, vx - vy);
  return blob;
}

BlobFrame frame_of(int image, const std::vector<Point>& discs, const Hidden& hidden) {
  BlobFrame frame;
  frame.exposed_at = from_ns(1) + from_s(image / kRate_hz);
  const auto show = [&](const std::vector<Point>& together) {
    const Blob blob = blob_of(together, hidden);
    if (blob.area_px2 >= 4.0) frame.blobs.push_back(blob);
  };
  if (discs.size() == 2 && (discs[0] - discs[1]).norm() < 2.0 * kRadius_px) {
    show(discs);
  } else {
    for (const Point& disc : discs) show({disc});
  }
  return frame;
}

/// The track ids of markers during a run.
struct IdHistory {
  std::vector<BlobTrackId> first_ids;  ///< by marker, in image 10
  std::vector<BlobTrackId> last_ids;   ///< by marker, in the last image
  int wrong = 0;                       ///< blobs of one marker with the id of another track
  int separate_without_id = 0;         ///< blobs of one marker without an id, after the markers merged
};

IdHistory track_markers(const std::vector<Path>& paths, int images, const Hidden& hidden = {}) {
  const auto tracker = make_blob_tracker({});
  IdHistory history;
  history.first_ids.resize(paths.size());
  bool was_merged = false;
  for (int image = 0; image < images; ++image) {
    std::vector<Point> discs;
    for (const Path& path : paths) discs.push_back(path(image));
    BlobFrame frame = frame_of(image, discs, hidden);
    tracker->track(frame);
    const bool merged = paths.size() == 2 && frame.blobs.size() == 1;
    was_merged = was_merged || merged;
    history.last_ids.assign(paths.size(), {});
    for (const Blob& blob : frame.blobs) {
      for (std::size_t m = 0; m < paths.size(); ++m) {
        if ((blob.centroid.v - discs[m]).norm() > 8.0) continue;
        if (image == 10) history.first_ids[m] = blob.track;
        history.last_ids[m] = blob.track;
        if (image <= 10) continue;
        const bool has_id = blob.track.names_something();
        if (has_id && blob.track != history.first_ids[m] && !merged) ++history.wrong;
        if (was_merged && !merged && !has_id) ++history.separate_without_id;
      }
    }
  }
  return history;
}

Path straight(const Point& at_40, const Point& per_image) {
  return [=](double image) -> Point { return at_40 + (image - 40.0) * per_image; };
}

/// A straight path to the point of image 40, then back.
Path there_and_back(const Point& at_40, const Point& per_image) {
  return [=](double image) -> Point { return at_40 - std::abs(image - 40.0) * per_image; };
}

TEST(BlobPair, KeepsTheIdsOfMarkersThatCrossAtAnyMissDistance) {
  for (const double miss_px : {0.0, 2.0, 5.0, 9.0, 13.0}) {
    for (const double speed : {1.5, 3.0, 6.0}) {
      const IdHistory history = track_markers(
          {straight({300.0, 200.0}, {speed, 0.4}), straight({300.0, 200.0 + miss_px}, {-speed, 0.4})}, 90);

      EXPECT_EQ(history.wrong, 0) << miss_px << " px, " << speed << " px";
      EXPECT_EQ(history.last_ids, history.first_ids) << miss_px << " px, " << speed << " px";
    }
  }
}

TEST(BlobPair, KeepsTheIdsOfMarkersThatTurnBack) {
  // At smaller miss distances, area and elongation of the merged blob are not precise enough.
  for (const double miss_px : {6.0, 9.0, 12.0}) {
    const IdHistory history = track_markers(
        {there_and_back({300.0, 200.0}, {3.0, 0.5}), there_and_back({300.0, 200.0 + miss_px}, {-2.0, 0.8})}, 90);

    EXPECT_EQ(history.wrong, 0) << miss_px << " px";
    EXPECT_EQ(history.last_ids, history.first_ids) << miss_px << " px";
  }
}

TEST(BlobPair, KeepsTheIdOfAMarkerThatPassesOneAtRest) {
  const IdHistory history =
      track_markers({straight({300.0, 200.0}, {0.0, 0.0}), straight({301.0, 203.0}, {3.0, 1.0})}, 80);

  EXPECT_EQ(history.wrong, 0);
  EXPECT_EQ(history.last_ids, history.first_ids);
}

TEST(BlobPair, GivesNoIdToABlobOfTwoMarkers) {
  const auto tracker = make_blob_tracker({});
  for (int image = 0; image < 60; ++image) {
    BlobFrame frame = frame_of(
        image, {straight({300.0, 200.0}, {3.0, 0.0})(image), straight({300.0, 203.0}, {-3.0, 0.0})(image)}, {});
    tracker->track(frame);
    if (image >= 5 && frame.blobs.size() == 1) {
      EXPECT_FALSE(frame.blobs[0].track.names_something()) << "image " << image;
      std::vector<BlobTrackBelief> beliefs;
      dynamic_cast<const BlobTrackInspection&>(*tracker).predict_tracks(frame.exposed_at, beliefs);
      ASSERT_EQ(beliefs.size(), 2U);
      for (const auto& belief : beliefs) {
        EXPECT_EQ(belief.state, BlobTrackState::Confirmed);
        EXPECT_FALSE(belief.sure);
        EXPECT_EQ(belief.blob, 0U);
      }
    }
  }
}

TEST(BlobPair, GivesIdsSoonAfterMarkersCrossed) {
  const IdHistory history =
      track_markers({straight({300.0, 200.0}, {3.0, 0.4}), straight({300.0, 206.0}, {-3.0, 0.4})}, 90);

  // At most three images with two blobs each.
  EXPECT_LE(history.separate_without_id, 6);
}

TEST(TrackBlobs, KeepsSpeedAndDirectionOfAMarkerThatGoesBehindABarrier) {
  const auto tracker = make_blob_tracker({});
  const auto& inspection = dynamic_cast<const BlobTrackInspection&>(*tracker);
  const Hidden barrier = [](const Point& at) { return at.x() > 300.0 && at.x() < 360.0; };
  BlobTrackId id;
  for (int image = 0; image < 90; ++image) {
    const Point truth(200.0 + 4.0 * image, 150.0 + 1.0 * image);
    BlobFrame frame = frame_of(image, {truth}, barrier);
    std::vector<BlobTrackBelief> expected;
    inspection.predict_tracks(frame.exposed_at, expected);
    if (image == 20) id = expected[0].track;
    if (image > 5) {
      ASSERT_EQ(expected.size(), 1U);
      // The centroid of the visible part is up to 7 px from the centre; the estimate of the occluded disc corrects it.
      EXPECT_LT((expected[0].point.v - truth).norm(), 1.5) << "image " << image;
      EXPECT_EQ(expected[0].state == BlobTrackState::Coasting, image > 27 && image <= 39) << "image " << image;
    }
    tracker->track(frame);
    if (image > 45) {
      EXPECT_EQ(frame.blobs[0].track, id);
    }
  }
}

TEST(TrackBlobs, KeepsTheIdsOfTwoMarkersThatCrossBehindABarrier) {
  const Hidden barrier = [](const Point& at) { return at.x() > 270.0 && at.x() < 330.0; };

  const IdHistory history =
      track_markers({straight({300.0, 200.0}, {4.0, 1.0}), straight({303.0, 205.0}, {-3.5, 1.5})}, 90, barrier);

  EXPECT_EQ(history.wrong, 0);
  EXPECT_EQ(history.last_ids, history.first_ids);
}

TEST(TrackBlobs, DoesNotGiveTheIdOfAHiddenMarkerToANeighbour) {
  const auto tracker = make_blob_tracker({});
  std::vector<BlobTrackId> ids(3);
  for (int image = 0; image < 40; ++image) {
    // Three markers on a line, 16 px apart, move together; the middle one disappears.
    const bool hidden = image >= 20 && image < 30;
    std::vector<Point> discs;
    for (int m = 0; m < 3; ++m) {
      if (m != 1 || !hidden) discs.push_back({100.0 + 16.0 * m + 3.0 * image, 200.0 + 10.0 * std::sin(0.2 * image)});
    }
    BlobFrame frame = frame_of(image, {}, {});
    for (const Point& disc : discs) frame.blobs.push_back(blob_of({disc}, {}));
    tracker->track(frame);
    std::vector<BlobTrackId> now;
    for (const Blob& blob : frame.blobs) now.push_back(blob.track);
    if (image == 10) ids = now;
    if (image <= 10) continue;
    EXPECT_EQ(now, hidden ? (std::vector<BlobTrackId>{ids[0], ids[2]}) : ids) << "image " << image;
  }
}

TEST(TrackBlobs, ReportsATrackFromItsFirstToItsLastImage) {
  TrackBlobsSettings settings;
  settings.max_coast = std::chrono::milliseconds(110);
  const auto tracker = make_blob_tracker(settings);
  const auto& inspection = dynamic_cast<const BlobTrackInspection&>(*tracker);
  std::vector<BlobTrackState> states;
  std::vector<double> reach_px;
  for (int image = 0; image < 36; ++image) {
    BlobFrame frame = frame_of(image, {}, {});
    if (image < 30) frame.blobs.push_back(blob_of({{100.0, 100.0}}, {}));
    tracker->track(frame);
    std::vector<BlobTrackBelief> beliefs;
    inspection.predict_tracks(frame.exposed_at, beliefs);
    for (const auto& belief : beliefs) {
      if (states.empty() || states.back() != belief.state || belief.state == BlobTrackState::Coasting) {
        states.push_back(belief.state);
        reach_px.push_back(belief.gate_radius_px);
      }
    }
  }

  using enum BlobTrackState;
  EXPECT_EQ(states, (std::vector{Tentative, Confirmed, Coasting, Coasting, Coasting, Lost}));
  // 10 px for each image without a measurement (300 px/s at 30 Hz), and less for the growth of the covariance.
  EXPECT_NEAR(reach_px[3] - reach_px[2], 10.0, 4.0);
  EXPECT_NEAR(reach_px[4] - reach_px[3], 10.0, 4.0);
}

}  // namespace blob_pair_test
}  // namespace mocap::track2d
