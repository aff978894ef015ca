#include "synchronise/frame_aligner.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "synchronise/alignment_world.h"

namespace mocap::synchronise {
namespace frame_aligner_test {

using std::chrono::microseconds;

std::vector<std::uint32_t> cameras_of(const FrameSet& set) {
  std::vector<std::uint32_t> ids;
  for (const BlobFrame* view : set.views) ids.push_back(view->camera.value);
  return ids;
}

TEST(FrameAligner, ReturnsASetOnceEveryCameraHasDelivered) {
  FrameAligner aligner(kSettings, 2);
  aligner.add(seen_by(1, 1100));
  EXPECT_FALSE(aligner.take(kForever));

  aligner.add(seen_by(0, 1000));
  const auto set = aligner.take(kForever);

  ASSERT_TRUE(set);
  EXPECT_EQ(cameras_of(*set), (std::vector<std::uint32_t>{0, 1}));
  EXPECT_EQ(set->exposed_at, at(1050));
  EXPECT_EQ(set->expected_views, 2u);
  EXPECT_EQ(set->number, 0u);
  EXPECT_EQ(aligner.counts().complete, 1u);
}

TEST(FrameAligner, ReturnsASetWithoutTheLateCameraAfterPatience) {
  FrameAligner aligner(kSettings, 2);
  aligner.add(seen_by(0, 1000));

  EXPECT_FALSE(aligner.take(at(2999)));
  EXPECT_EQ(aligner.patience_ends(), at(3000));
  EXPECT_TRUE(aligner.take(at(3000)));
  EXPECT_EQ(aligner.patience_ends(), std::nullopt);
}

TEST(FrameAligner, MeasuresPatienceFromTheFirstArrival) {
  FrameAligner aligner(kSettings, 3);
  aligner.add(seen_by(0, 1000, 9000));
  aligner.add(seen_by(1, 1100, 7000));  // exposed later, arrives earlier

  EXPECT_FALSE(aligner.take(at(1100 + 7000 + 1999)));
  EXPECT_TRUE(aligner.take(at(1100 + 7000 + 2000)));
}

TEST(FrameAligner, ASetIsSupersededOnlyByNewerImagesOfItsCameras) {
  FrameAligner aligner(kSettings, 3);
  for (const std::uint32_t camera : {0, 1}) aligner.add(seen_by(camera, 1000));
  aligner.add(seen_by(2, 1650));  // not synchronised
  const auto together = aligner.take(kForever);
  ASSERT_TRUE(together);
  ASSERT_EQ(cameras_of(*together), (std::vector<std::uint32_t>{0, 1}));
  const Timestamp late = at(1650 + 2000);

  ASSERT_TRUE(aligner.ready(late));  // the set of camera 2
  EXPECT_FALSE(aligner.is_superseded(*together, late));

  aligner.add(seen_by(0, 11000));
  EXPECT_FALSE(aligner.is_superseded(*together, late));
  aligner.add(seen_by(1, 11000));
  EXPECT_TRUE(aligner.is_superseded(*together, late));
}

// One camera of four has exposures half a millisecond or more after the others, all images arrive together.
TEST(FrameAligner, ACameraThatIsNotSynchronisedTakesNoSetFromTheOthers) {
  for (const std::int64_t offset_us : {-5000, -650, 650, 2000, 5000}) {
    FrameAligner aligner({.window = microseconds(500), .patience = std::chrono::milliseconds(30)}, 4);
    int fused = 0;
    for (std::int64_t set = 0; set < 1000; ++set) {
      const std::int64_t t_us = 10000 * set;
      for (const std::uint32_t camera : {0, 1, 2}) aligner.add(seen_by(camera, t_us, 8000));
      aligner.add(seen_by(3, t_us + offset_us, 8000 - offset_us));
      const Timestamp now = at(t_us + 8000);
      while (const auto ready = aligner.take(now)) {
        if (ready->views.size() == 3 && !aligner.is_superseded(*ready, now)) ++fused;
      }
      if (set % 100 == 99) aligner.assess_timing();
    }
    EXPECT_GE(fused, 990) << offset_us;
  }
}

TEST(FrameAligner, DropsAndCountsALateFrameButNotTheNextOne) {
  FrameAligner aligner(kSettings, 2);
  aligner.add(seen_by(0, 1000));
  ASSERT_TRUE(aligner.take(at(3000)));

  aligner.add(seen_by(1, 1000));
  aligner.add(seen_by(0, 9000));
  aligner.add(seen_by(1, 9000));
  const auto set = aligner.take(kForever);

  ASSERT_TRUE(set);
  EXPECT_EQ(set->views.size(), 2u);
  EXPECT_EQ(set->exposed_at, at(9000));
  EXPECT_EQ(aligner.counts().late, 1u);
}

TEST(FrameAligner, DoesNotWaitForALostFrame) {
  FrameAligner aligner(kSettings, 2);
  aligner.add(seen_by(0, 1000));
  aligner.add(seen_by(1, 9000));  // camera 1 lost the image at 1000

  const auto set = aligner.take(kForever);

  ASSERT_TRUE(set);
  EXPECT_EQ(cameras_of(*set), (std::vector<std::uint32_t>{0}));
  EXPECT_FALSE(aligner.take(kForever));  // the set at 9000 waits for camera 0
}

TEST(FrameAligner, DropsAndCountsARepeatedFrame) {
  FrameAligner aligner(kSettings, 2);
  aligner.add(seen_by(0, 1000));
  aligner.add(seen_by(0, 1000));
  aligner.add(seen_by(0, 900));
  aligner.add(seen_by(1, 1000));

  ASSERT_TRUE(aligner.take(kForever));
  EXPECT_FALSE(aligner.take(at(1'000'000)));
  EXPECT_EQ(aligner.counts().repeated, 2u);
}

// Seed 9 of mocap-chaos: an image waited while its camera was unplugged and back.
TEST(FrameAligner, CountsTheFramesThatWaitWhenTheirCameraIsStartedAgain) {
  FrameAligner aligner(kSettings, 2);
  aligner.add(seen_by(0, 1000));
  aligner.add(seen_by(0, 9000));

  aligner.finish(CameraId{0});
  aligner.rejoin(CameraId{0});

  EXPECT_EQ(aligner.counts().cleared, 2u);
}

TEST(FrameAligner, CountsEachFrameOnceWhenAClockIsSetBack) {
  FrameAligner aligner(kSettings, 2);
  aligner.add(seen_by(0, 900'000));  // waits for camera 1, and is dropped with the new time

  for (int i = 0; i < 8; ++i) aligner.add(seen_by(0, 1000 + i * 8000));

  EXPECT_EQ(aligner.counts().repeated, 7u);
  EXPECT_EQ(aligner.counts().cleared, 1u);
}

TEST(FrameAligner, AcceptsACameraAgainAfterAClockJump) {
  FrameAligner aligner(kSettings, 2);
  aligner.add(seen_by(1, 1'000'000'000));  // a wrong time stamp
  std::size_t with_both = 0;
  for (int i = 0; i < 20; ++i) {
    aligner.add(seen_by(0, 1000 + 8000 * i));
    aligner.add(seen_by(1, 1000 + 8000 * i));
    while (const auto set = aligner.take(at(8000 * i + 7000))) with_both += set->views.size() == 2 ? 1 : 0;
  }

  EXPECT_EQ(with_both, 20u - 7u);
}

TEST(FrameAligner, KeepsFramesOfAFinishedCameraWithoutWaitingForIt) {
  FrameAligner aligner(kSettings, 2);
  aligner.add(seen_by(1, 1000));
  aligner.finish(CameraId{1});
  EXPECT_EQ(aligner.expected_cameras(), 1u);
  EXPECT_FALSE(aligner.is_expected(CameraId{1}));

  aligner.add(seen_by(0, 1000));
  ASSERT_EQ(aligner.take(kForever)->views.size(), 2u);
  aligner.add(seen_by(0, 9000));
  const auto alone = aligner.take(kForever);
  ASSERT_TRUE(alone);
  EXPECT_EQ(alone->views.size(), 1u);
  EXPECT_EQ(alone->expected_views, 1u);

  aligner.rejoin(CameraId{1});
  aligner.add(seen_by(0, 17000));
  EXPECT_FALSE(aligner.take(kForever));
  aligner.add(seen_by(1, 17000));
  EXPECT_EQ(aligner.take(kForever)->views.size(), 2u);
}

TEST(FrameAligner, DropsAndCountsFramesOfACameraFarAhead) {
  FrameAligner aligner(kSettings, 2);
  int kept = 0;
  while (aligner.has_room(CameraId{0})) aligner.add(seen_by(0, 1000 + 8000 * kept++));
  EXPECT_EQ(kept, 8);
  EXPECT_TRUE(aligner.has_room(CameraId{1}));

  aligner.add(seen_by(0, 1'000'000));

  EXPECT_EQ(aligner.counts().overflow, 1u);
}

TEST(FrameAligner, ReportsTheSkewOfEachCamera) {
  FrameAligner aligner(kSettings, 2);
  for (int i = 0; i < 3; ++i) {
    aligner.add(seen_by(0, 1000 + 8000 * i));
    aligner.add(seen_by(1, 1200 + 8000 * i));
    ASSERT_TRUE(aligner.take(kForever));
  }

  EXPECT_EQ(aligner.skew(CameraId{0}).mean(), microseconds(-100));
  EXPECT_EQ(aligner.skew(CameraId{1}).mean(), microseconds(100));
  EXPECT_EQ(aligner.skew(CameraId{1}).largest, microseconds(100));
}

TEST(FrameAligner, KeepsTheViewsOfASetUntilTheNextCall) {
  FrameAligner aligner(kSettings, 2);
  BlobFrame frame = seen_by(0, 1000);
  frame.number = 77;
  Blob blob;
  blob.centroid = {{3.0, 4.0}};
  frame.blobs.push_back(blob);
  aligner.add(frame);
  aligner.add(seen_by(1, 1000));

  const auto set = aligner.take(kForever);
  frame.blobs.clear();  // the aligner has its own copy

  ASSERT_TRUE(set);
  EXPECT_EQ(set->views[0]->number, 77u);
  ASSERT_EQ(set->views[0]->blobs.size(), 1u);
  EXPECT_EQ(set->views[0]->blobs[0].centroid.v.y(), 4.0);
}

// A set that the aligner returned: its exposure and the cameras of its views.
struct Given {
  Timestamp exposed_at;
  std::vector<std::uint32_t> cameras;
  bool operator==(const Given&) const = default;
};

// Adds the frames as a replay does: each camera's frames in order, the cameras interleaved at random. Drops nothing.
std::vector<Given> replay(const std::vector<std::vector<BlobFrame>>& frames, unsigned seed) {
  FrameAligner aligner(kSettings, frames.size());
  std::vector<std::size_t> next(frames.size(), 0);
  std::vector<Given> given;
  std::mt19937 random(seed);
  const auto drain = [&] {
    while (const auto set = aligner.take(kForever)) given.push_back({set->exposed_at, cameras_of(*set)});
  };
  std::size_t left = frames.size();
  while (left > 0) {
    const std::size_t c = random() % frames.size();
    const CameraId camera{static_cast<std::uint32_t>(c)};
    if (next[c] > frames[c].size() || !aligner.has_room(camera)) continue;
    if (next[c] == frames[c].size()) {
      aligner.finish(camera);
      --left;
    } else {
      aligner.add(frames[c][next[c]]);
    }
    ++next[c];
    drain();
  }
  EXPECT_EQ(aligner.counts().overflow, 0u);
  return given;
}

TEST(FrameAligner, ReturnsTheSameSetsForAnyOrderOfDelivery) {
  std::mt19937 random(7);
  std::vector<std::vector<BlobFrame>> frames(4);
  for (std::uint32_t c = 0; c < 4; ++c) {
    for (int i = 0; i < 200; ++i) {
      if (random() % 10 == 0) continue;  // lost
      frames[c].push_back(seen_by(c, 10'000 + 8333 * i + static_cast<int>(random() % 400)));
      if (random() % 20 == 0) frames[c].push_back(frames[c].back());  // repeated
    }
  }

  const auto first = replay(frames, 1);
  const auto second = replay(frames, 2);

  EXPECT_GT(first.size(), 195u);
  EXPECT_EQ(first, second);
}

// The arrival of one image; cameras have different delays.
struct Delivery {
  Timestamp arrives_at;
  BlobFrame frame;
  int instant = 0;
};

struct Network {
  std::size_t cameras = 4;
  int instants = 300;
  double lost = 0.03;
  double repeated = 0.02;
  double straggles = 0.0;  ///< fraction of camera 0's images that arrive 15 ms late
};

constexpr std::int64_t kPeriod_us = 8333;
constexpr std::int64_t kMostDelay_us = 1500;  // delays differ by less than patience

std::vector<Delivery> deliveries(const Network& network, std::mt19937& random) {
  const auto chance = [&](double share) { return std::uniform_real_distribution<double>(0.0, 1.0)(random) < share; };
  std::vector<Delivery> all;
  for (std::uint32_t c = 0; c < network.cameras; ++c) {
    const auto delay_us = static_cast<std::int64_t>(random() % kMostDelay_us);
    // The camera's clock drifts, by at most 60 us at the end.
    const double drift = 0.2 * static_cast<double>(random() % 100) / 100.0;
    for (int i = 0; i < network.instants; ++i) {
      if (chance(network.lost)) continue;
      const auto off_us = static_cast<std::int64_t>(drift * i) + static_cast<std::int64_t>(random() % 200);
      const std::int64_t late_us = c == 0 && chance(network.straggles) ? 15'000 : 0;
      Delivery one{{}, seen_by(c, 10'000 + kPeriod_us * i + off_us, delay_us + late_us), i};
      one.frame.number = static_cast<std::uint64_t>(i);
      one.arrives_at = one.frame.received_at;
      all.push_back(one);
      if (chance(network.repeated)) all.push_back(one);
    }
  }
  std::ranges::stable_sort(all, {}, &Delivery::arrives_at);
  // Each camera delivers its images in order, also the late ones.
  for (std::uint32_t c = 0; c < network.cameras; ++c) {
    std::vector<Delivery*> own;
    for (Delivery& one : all) {
      if (one.frame.camera.value == c) own.push_back(&one);
    }
    std::vector<Delivery> sorted;
    for (const Delivery* one : own) sorted.push_back(*one);
    std::ranges::stable_sort(sorted, {}, [](const Delivery& one) { return one.frame.exposed_at; });
    for (std::size_t i = 0; i < own.size(); ++i) {
      const Timestamp arrives_at = own[i]->arrives_at;
      *own[i] = sorted[i];
      own[i]->arrives_at = own[i]->frame.received_at = own[i]->frame.detected_at = arrives_at;
    }
  }
  return all;
}

// Result of a live run, in which `take` is called at each arrival and whenever patience ends.
struct LiveRun {
  std::vector<std::vector<std::pair<std::uint32_t, std::uint64_t>>> sets;  // camera and number of each view
  std::vector<Timestamp> exposures;
  AlignCounts counts;
};

LiveRun run_live(const std::vector<Delivery>& all, std::size_t cameras) {
  FrameAligner aligner(kSettings, cameras);
  LiveRun run;
  const auto look = [&](Timestamp now) {
    while (const auto set = aligner.take(now)) {
      auto& views = run.sets.emplace_back();
      run.exposures.push_back(set->exposed_at);
      for (const BlobFrame* view : set->views) {
        views.emplace_back(view->camera.value, view->number);
        EXPECT_LE(view->exposed_at - set->views.front()->exposed_at, kSettings.window);
      }
    }
  };
  for (const Delivery& one : all) {
    while (aligner.patience_ends() && *aligner.patience_ends() < one.arrives_at) look(*aligner.patience_ends());
    aligner.add(one.frame);
    look(one.arrives_at);
  }
  look(all.back().arrives_at + std::chrono::seconds(1));
  run.counts = aligner.counts();
  return run;
}

TEST(FrameAligner, ReturnsEveryImageOnceForAnyDelays) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    const Network network{.cameras = 2 + seed % 7};
    const auto all = deliveries(network, random);

    const LiveRun run = run_live(all, network.cameras);

    EXPECT_TRUE(std::ranges::is_sorted(run.exposures));
    std::size_t given = 0;
    for (const auto& views : run.sets) {
      given += views.size();
      for (const auto& [camera, number] : views)
        EXPECT_EQ(number, views.front().second) << "one instant, seed " << seed;
    }
    EXPECT_EQ(given + run.counts.repeated, all.size()) << "seed " << seed;
    EXPECT_EQ(run.counts.late, 0U) << "all come within patience, seed " << seed;
    std::set<int> seen;
    for (const Delivery& one : all) seen.insert(one.instant);
    EXPECT_EQ(run.sets.size(), seen.size()) << "one set an instant, seed " << seed;
  }
}

TEST(FrameAligner, LosesOnlyTheViewOfALateCamera) {
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    const Network network{.cameras = 4, .lost = 0.0, .repeated = 0.0, .straggles = 0.2};
    const auto all = deliveries(network, random);

    const LiveRun run = run_live(all, network.cameras);

    std::vector<int> views_of_others(static_cast<std::size_t>(network.instants), 0);
    for (const auto& views : run.sets) {
      std::size_t others = 0;
      for (const auto& [camera, number] : views) others += camera != 0 ? 1 : 0;
      if (others == 0) continue;
      EXPECT_EQ(others, 3U) << "the others are not torn apart, seed " << seed;
      ++views_of_others[views.back().second];
    }
    for (const int times : views_of_others) EXPECT_EQ(times, 1) << "seed " << seed;
    EXPECT_GT(run.counts.late, 10U);
    EXPECT_EQ(run.counts.overflow, 0U);
  }
}

TEST(FrameAligner, ReportsACameraWhoseFramesMatchNoOtherCamera) {
  FrameAligner aligner(kSettings, 3);
  for (int i = 0; i < 1000; ++i) {
    aligner.add(seen_by(0, 10'000 + 10'000 * i));
    aligner.add(seen_by(1, 10'050 + 10'000 * i));
    aligner.add(seen_by(2, 13'100 + 10'000 * i + i / 3));
    while (aligner.take(at(18'000 + 10'000 * i))) continue;
  }
  aligner.assess_timing();

  EXPECT_TRUE(aligner.timing(CameraId{0}).synchronised);
  EXPECT_TRUE(aligner.timing(CameraId{1}).synchronised);
  EXPECT_FALSE(aligner.timing(CameraId{2}).synchronised);
  EXPECT_NEAR(aligner.timing(CameraId{2}).drift_us_s, 33.3, 2.0);
}

TEST(MeanExposure, IsThatOfAllViews) {
  const BlobFrame west = seen_by(0, 10'000), north = seen_by(1, 10'050), east = seen_by(2, 9'980);
  FrameSet set;
  for (const BlobFrame* view : {&west, &north, &east}) set.views.push_back(view);

  EXPECT_EQ(mean_exposure(set), at(10'010));
}

}  // namespace frame_aligner_test
}  // namespace mocap::synchronise
