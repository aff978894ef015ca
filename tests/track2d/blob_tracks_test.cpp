#include "track2d/blob_tracks.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <random>
#include <vector>

namespace mocap::track2d {
namespace blob_tracks_test {

using Point = filter::Vector<2>;

constexpr double kStep_s = 0.01;
constexpr filter::IsotropicKalmanSettings kKalman{.acceleration_u_s2 = 2000.0, .initial_speed_u_s = 200.0};

// A motion filter with a gate of four standard deviations plus 6 px.
class Follower {
 public:
  Follower(const Point& point, double variance_px2) : kalman_(kKalman, point, variance_px2) {}

  void predict(double dt_s) { kalman_.predict(dt_s); }
  BlobAim aim() const {
    return {kalman_.motion().point, kalman_.motion().pp, 6.0 + 4.0 * std::sqrt(kalman_.motion().pp)};
  }
  void update(const Point& point, double variance_px2) { kalman_.update(point, variance_px2); }
  void coast() { kalman_.coast(); }
  const filter::IsotropicKalman<2>& kalman() const { return kalman_; }
  void restart(const filter::IsotropicKalman<2>& estimate) { kalman_ = estimate; }

 private:
  filter::IsotropicKalman<2> kalman_;
};

constexpr double kArea_px2 = 30.0;  // a disc of 6 px

Blob blob_at(const Point& point, double area_px2 = kArea_px2, double roundness = 1.0) {
  Blob blob;
  blob.centroid = {point};
  blob.sigma_px = 0.05;
  blob.area_px2 = area_px2;
  blob.roundness = roundness;
  blob.axis_rad = 0.0;
  return blob;
}

// The tracks of a camera that takes one image each 10 ms.
struct Camera {
  explicit Camera(std::size_t max_blobs = 50, Duration max_coast = std::chrono::milliseconds(95))
      : tracks({3, max_coast}, max_blobs) {}

  void see(const std::vector<Blob>& blobs) {
    tracks.step(from_ns(0) + from_s(kStep_s * ++image), blobs,
                [](const Point& point, double variance_px2) { return Follower(point, variance_px2); });
  }
  const BlobTracks<Follower>::Track* find(std::uint32_t id) const {
    for (const auto& track : tracks.tracks()) {
      if (track.id == id) return &track;
    }
    return nullptr;
  }

  BlobTracks<Follower> tracks;
  int image = 0;
};

TEST(BlobTracks, FollowMovingBlobsWhoseOrderChanges) {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0.0, 0.05);
  std::uniform_real_distribution<double> speed(-150.0, 150.0);
  std::vector<Point> places, speeds_px_s;
  for (int i = 0; i < 30; ++i) {
    places.emplace_back(100.0 + 150.0 * (i % 6), 100.0 + 150.0 * (i / 6));
    speeds_px_s.emplace_back(speed(random), speed(random));
  }
  std::vector<std::size_t> point_of_track(30);
  Camera camera;

  for (int image = 0; image < 30; ++image) {
    // The first image has the blobs in order of the points.
    const auto blob_of = [&](std::size_t point) { return image % 2 == 0 ? point : 29 - point; };
    std::vector<Blob> blobs(30);
    for (std::size_t i = 0; i < 30; ++i) {
      places[i] += kStep_s * speeds_px_s[i];
      blobs[blob_of(i)] = blob_at(places[i] + Point(noise(random), noise(random)));
    }
    camera.see(blobs);
    if (image == 0) {
      for (const auto& track : camera.tracks.tracks()) point_of_track[track.id] = track.blob;
    }

    ASSERT_EQ(camera.tracks.tracks().size(), 30U);
    for (const auto& track : camera.tracks.tracks()) EXPECT_EQ(track.blob, blob_of(point_of_track[track.id]));
  }

  for (const auto& track : camera.tracks.tracks()) {
    EXPECT_TRUE(track.confirmed && track.sure);
    // px: the noise is 0.05 px
    EXPECT_LT((track.follower.kalman().motion().point - places[point_of_track[track.id]]).norm(), 0.3);
  }
}

TEST(BlobTracks, EndAfterAGapInWhichTheirMarkersMayHaveExchangedPlaces) {
  constexpr int kNeighbours = 6;
  Camera camera(50, std::chrono::seconds(2));
  const Point alone(400.0, 300.0);
  const auto row = [&](double x_px) {
    std::vector<Blob> blobs;
    for (int i = 0; i < kNeighbours; ++i) blobs.push_back(blob_at({x_px + 10.0 * i, 100.0}));
    blobs.push_back(blob_at(alone));
    return blobs;
  };
  for (int i = 0; i < 20; ++i) camera.see(row(100.0));

  camera.image += 30;      // images are lost for 0.3 s
  camera.see(row(113.0));  // each marker is now near the former place of its neighbour

  EXPECT_EQ(camera.tracks.lost().size(), static_cast<std::size_t>(kNeighbours));
  for (std::uint32_t id = 0; id < kNeighbours; ++id) EXPECT_EQ(camera.find(id), nullptr) << id;
  ASSERT_NE(camera.find(kNeighbours), nullptr) << "the blob without a neighbour keeps its track";
  EXPECT_EQ(camera.find(kNeighbours)->blob, static_cast<std::uint32_t>(kNeighbours));
  for (int i = 0; i < 3; ++i) camera.see(row(113.0));
  EXPECT_EQ(camera.tracks.tracks().size(), kNeighbours + 1U);
  for (const auto& track : camera.tracks.tracks()) EXPECT_TRUE(track.confirmed) << track.id;
}

TEST(BlobTracks, AreConfirmedByThreeImagesAndATentativeOneEndsWithoutItsBlob) {
  Camera camera;
  const Point known(100.0, 100.0), flash(300.0, 100.0);

  camera.see({blob_at(known)});
  camera.see({blob_at(known), blob_at(flash)});
  EXPECT_FALSE(camera.find(0)->confirmed);
  camera.see({blob_at(known)});

  ASSERT_EQ(camera.tracks.tracks().size(), 1U);
  EXPECT_TRUE(camera.find(0)->confirmed);
}

TEST(BlobTracks, CoastForTheirTimeThenAreLostOnceWithTheirPredictedPlace) {
  Camera camera;
  for (int i = 0; i < 5; ++i) camera.see({blob_at({100.0, 100.0})});

  for (int i = 0; i < 9; ++i) {
    camera.see({});
    ASSERT_NE(camera.find(0), nullptr);
    EXPECT_TRUE(camera.tracks.lost().empty());
  }
  camera.see({});  // 100 ms without a blob

  EXPECT_TRUE(camera.tracks.tracks().empty());
  ASSERT_EQ(camera.tracks.lost().size(), 1U);
  EXPECT_EQ(camera.tracks.lost()[0].id, 0U);
  EXPECT_LT((camera.tracks.lost()[0].expected_px - Point(100.0, 100.0)).norm(), 0.5);
  camera.see({blob_at({100.0, 100.0})});
  EXPECT_TRUE(camera.tracks.lost().empty());
  EXPECT_EQ(camera.tracks.tracks()[0].id, 1U);
}

// The blob of two discs of kArea_px2 that overlap.
Blob merged_blob(const Point& first, const Point& second) {
  const double distance = (second - first).norm() / std::sqrt(kArea_px2 / M_PI);  // in radii
  const double half = 0.5 * distance;
  const double shared = half < 1.0 ? 2.0 / M_PI * (std::acos(half) - half * std::sqrt(1.0 - half * half)) : 0.0;
  // The ratio of the axes is that of two separate discs, which differs little from that of their union.
  Blob blob = blob_at(0.5 * (first + second), kArea_px2 * (2.0 - shared), std::sqrt(1.0 / (1.0 + distance * distance)));
  const Point apart = second - first;
  blob.axis_rad = std::atan2(apart.y(), apart.x());
  return blob;
}

TEST(BlobTracks, ShareTheMergedBlobOfTwoMarkersAndSeparateAfterwards) {
  // Two markers pass each other 3 px apart.
  Camera camera;
  std::uint32_t first_id = 0, second_id = 0;
  bool was_shared = false;
  for (int image = 0; image < 40; ++image) {
    const double x = 1.5 * (image - 20);
    const Point first(100.0 + x, 98.5), second(100.0 - x, 101.5);
    if ((first - second).norm() > 6.5) {
      camera.see({blob_at(first), blob_at(second)});
      if (image == 10) {
        for (const auto& track : camera.tracks.tracks()) (track.blob == 0 ? first_id : second_id) = track.id;
      }
      continue;
    }
    camera.see({merged_blob(first, second)});
    ASSERT_EQ(camera.tracks.tracks().size(), 2U) << "image " << image;
    if (camera.find(first_id)->blob != 0 || camera.find(second_id)->blob != 0) continue;
    was_shared = true;
    EXPECT_FALSE(camera.find(first_id)->sure || camera.find(second_id)->sure);
  }

  EXPECT_TRUE(was_shared);
  ASSERT_EQ(camera.tracks.tracks().size(), 2U);
  EXPECT_EQ(camera.find(first_id)->blob, 0U);
  EXPECT_EQ(camera.find(second_id)->blob, 1U);
  EXPECT_TRUE(camera.find(first_id)->sure && camera.find(second_id)->sure);
  EXPECT_TRUE(camera.tracks.pairs().empty());
}

TEST(BlobTracks, CorrectTheCentroidOfAMarkerThatIsPartlyHidden) {
  // The right half of a disc of radius 10 px is hidden: the centroid of the other half is 4 / (3 pi) radii to the left.
  const double radius_px = 10.0, area_px2 = M_PI * radius_px * radius_px;
  Camera camera;
  for (int i = 0; i < 20; ++i) camera.see({blob_at({100.0, 100.0}, area_px2)});
  Blob half = blob_at({100.0 - 4.0 / (3.0 * M_PI) * radius_px, 100.0}, 0.5 * area_px2, 0.529);
  half.axis_rad = 0.5 * M_PI;

  for (int i = 0; i < 3; ++i) camera.see({half});

  ASSERT_EQ(camera.tracks.tracks().size(), 1U);
  // px: a quarter of the error without the correction
  EXPECT_LT((camera.find(0)->follower.kalman().motion().point - Point(100.0, 100.0)).norm(), 1.0);
}

TEST(BlobTracks, IgnoreBlobsThatAreNotFinite) {
  Camera camera;
  Blob unknown = blob_at({std::nan(""), 100.0});

  for (int i = 0; i < 4; ++i) camera.see({unknown, blob_at({50.0, 50.0})});

  ASSERT_EQ(camera.tracks.tracks().size(), 1U);
  EXPECT_EQ(camera.find(0)->blob, 1U);
}

TEST(BlobTracks, StartNoTrackBeyondTwiceTheBlobsOfAnImage) {
  Camera camera(2);
  // Two new places in each image: the confirmed tracks of the earlier places coast.
  for (int place = 0; place < 3; ++place) {
    const double x = 100.0 + 200.0 * place;
    for (int i = 0; i < 3; ++i) camera.see({blob_at({x, 100.0}), blob_at({x, 300.0})});
  }

  EXPECT_EQ(camera.tracks.tracks().size(), 4U);
}

}  // namespace blob_tracks_test
}  // namespace mocap::track2d
