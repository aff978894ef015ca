// Measures the laws of the study's clips on generated clips.
#include "paper_study/clip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace mocap::paper_study {
namespace paper_clip_test {

constexpr std::uint64_t kClips = 200;

std::vector<double> speeds_of(const Clip& clip, std::size_t marker = 0) {
  std::vector<double> speeds;
  const auto& way = clip.ways_px[marker];
  for (std::size_t k = 1; k < way.size(); ++k) speeds.push_back((way[k] - way[k - 1]).norm());
  return speeds;
}

/// The cosine of the change of heading in each frame except the first and the last.
std::vector<double> bends_of(const Clip& clip) {
  std::vector<double> bends;
  const auto& way = clip.ways_px[0];
  for (std::size_t k = 1; k + 1 < way.size(); ++k) {
    bends.push_back((way[k] - way[k - 1]).normalized().dot((way[k + 1] - way[k]).normalized()));
  }
  return bends;
}

std::vector<Situation> all_situations() {
  std::vector<Situation> all(kStudied.begin(), kStudied.end());
  all.insert(all.end(), kHarder.begin(), kHarder.end());
  return all;
}

TEST(Clip, IsTheSameForTheSameSeedAndAnotherForAnother) {
  for (const Situation situation : all_situations()) {
    EXPECT_EQ(make_clip(situation, 3).ways_px, make_clip(situation, 3).ways_px);
    EXPECT_NE(make_clip(situation, 3).ways_px, make_clip(situation, 4).ways_px);
    EXPECT_NE(clip_seed(1, situation, 0), clip_seed(2, situation, 0));
    EXPECT_NE(clip_seed(1, situation, 0), clip_seed(1, situation, 1));
  }
}

TEST(Clip, StaysTwentyPixelsFromTheBorder) {
  for (const Situation situation : all_situations()) {
    for (std::uint64_t seed = 0; seed < kClips; ++seed) {
      for (const auto& way : make_clip(situation, seed).ways_px) {
        for (const Eigen::Vector2d& point : way) {
          ASSERT_GE(point.minCoeff(), 20.0 - 1e-6) << name_of(situation) << " " << seed;
          ASSERT_LE(point.x(), kWidth_px - 21.0 + 1e-6) << name_of(situation) << " " << seed;
          ASSERT_LE(point.y(), kHeight_px - 21.0 + 1e-6) << name_of(situation) << " " << seed;
        }
      }
    }
  }
}

TEST(Clip, HasAsManyScoredFramesAsTheStudy) {
  // 1700, 1080 and 1700 samples of 20 clips; the label is assigned in the first frame.
  EXPECT_EQ(make_clip(Situation::Slow, 1).frames(), 86U);
  EXPECT_EQ(make_clip(Situation::Rapid, 1).frames(), 55U);
  EXPECT_EQ(make_clip(Situation::Accelerated, 1).frames(), 86U);
}

struct Zigzag {
  Situation situation;
  double min_speed_px, max_speed_px, min_leg_px, max_leg_px;
};

class ZigzagClip : public ::testing::TestWithParam<Zigzag> {};

TEST_P(ZigzagClip, HasConstantSpeedAndTheSpecifiedLegLength) {
  double frames = 0.0, legs = 0.0, way_px = 0.0, slowest_px = 1e9, fastest_px = 0.0;
  for (std::uint64_t seed = 0; seed < kClips; ++seed) {
    const Clip clip = make_clip(GetParam().situation, seed);
    const std::vector<double> speeds = speeds_of(clip);
    const double speed_px = *std::ranges::max_element(speeds);  // the motion in a frame with a turn is shorter
    slowest_px = std::min(slowest_px, speed_px);
    fastest_px = std::max(fastest_px, speed_px);
    for (const double bend : bends_of(clip)) {
      if (bend < 1.0 - 1e-9) legs += 0.5;  // the direction in a frame with a turn differs from both neighbours
    }
    frames += static_cast<double>(speeds.size());
    way_px += speed_px * static_cast<double>(speeds.size());
  }
  EXPECT_NEAR(slowest_px, GetParam().min_speed_px, 0.3);
  EXPECT_NEAR(fastest_px, GetParam().max_speed_px, 0.3);
  // Clips with long legs have fewer legs, so the mean of 1 / leg is compared, with a tolerance of 10 %.
  const double spread = GetParam().max_leg_px - GetParam().min_leg_px;
  const double mean_leg_px = spread / std::log(GetParam().max_leg_px / GetParam().min_leg_px);
  EXPECT_NEAR(way_px / legs, mean_leg_px, 0.1 * mean_leg_px);
}

INSTANTIATE_TEST_SUITE_P(Study, ZigzagClip,
                         ::testing::Values(Zigzag{Situation::Slow, 20.0, 25.0, 80.0, 150.0},
                                           Zigzag{Situation::Rapid, 22.0, 32.0, 50.0, 120.0}),
                         [](const auto& test) { return name_of(test.param.situation); });

TEST(AcceleratedClip, AcceleratesConstantlyFromHalfAPixelPerFrameToAPeakAndBack) {
  double highest_px = 0.0, most_px = 0.0, least_px = 1e9;
  for (std::uint64_t seed = 0; seed < kClips; ++seed) {
    const std::vector<double> speeds = speeds_of(make_clip(Situation::Accelerated, seed));
    EXPECT_NEAR(speeds[0], 0.5, 1e-9);
    const double acceleration_px = speeds[1] - speeds[0];
    least_px = std::min(least_px, acceleration_px);
    most_px = std::max(most_px, acceleration_px);
    for (std::size_t k = 1; k < speeds.size(); ++k) {
      EXPECT_LE(std::abs(speeds[k] - speeds[k - 1]), acceleration_px + 1e-9);
    }
    highest_px = std::max(highest_px, *std::ranges::max_element(speeds));
  }
  EXPECT_NEAR(least_px, 1.0, 0.1);
  EXPECT_NEAR(most_px, 3.5, 0.1);
  EXPECT_LE(highest_px, 34.0 + 1e-9);
  EXPECT_GT(highest_px, 33.0);
}

TEST(OcclusionClip, HidesTheMarkerInTheMiddleOfItsPathAndNeverNearTheEnds) {
  int straight = 0;
  for (std::uint64_t seed = 0; seed < kClips; ++seed) {
    const Clip clip = make_clip(Situation::Occlusion, seed);
    const auto& way = clip.ways_px[0];
    const Barrier& barrier = clip.barriers.at(0);
    for (std::size_t k = 0; k < way.size(); ++k) {
      const bool end = k < 8 || k + 8 >= way.size();
      if (end) {
        EXPECT_GT(barrier.distance_px(way[k]), kDiscRadius_px);
      }
      const double nth = static_cast<double>(k) / static_cast<double>(way.size() - 1);
      if ((way[k] - barrier.centre_px).norm() < 1.0) {
        EXPECT_GT(nth, 0.35);
        EXPECT_LT(nth, 0.65);
      }
    }
    EXPECT_NEAR(barrier.half_height_px, barrier.half_length_px + 19.0, 1e-9);
    const std::vector<double> speeds = speeds_of(clip);
    EXPECT_GT(speeds[0], 2.9);
    EXPECT_LE(speeds[0], 7.0);
    if (std::ranges::all_of(bends_of(clip), [](double bend) { return bend > 1.0 - 1e-9; })) ++straight;
  }
  EXPECT_NEAR(straight, kClips / 2, 30);  // four standard deviations of a fair coin
}

TEST(SwappingClip, BringsTwoMarkersTogetherAndApartAgain) {
  int turned_back = 0;
  for (std::uint64_t seed = 0; seed < kClips; ++seed) {
    const Clip clip = make_clip(Situation::Swapping, seed);
    ASSERT_EQ(clip.ways_px.size(), 2U);
    const auto apart = [&](std::size_t k) { return (clip.ways_px[0][k] - clip.ways_px[1][k]).norm(); };
    EXPECT_GE(apart(0), 60.0);
    EXPECT_GE(apart(clip.frames() - 1), 40.0);
    double nearest_px = 1e9;
    for (std::size_t k = 0; k < clip.frames(); ++k) nearest_px = std::min(nearest_px, apart(k));
    EXPECT_LE(nearest_px, 8.0 + 5.0);  // the miss distance plus half a frame of relative motion
    if (clip.turned_back) ++turned_back;
  }
  EXPECT_NEAR(turned_back, kClips / 5, 23);  // four standard deviations
}

TEST(Barrier, MeasuresTheDistanceToItsEdge) {
  const Barrier barrier{{100.0, 50.0}, {0.6, 0.8}, 10.0, 20.0};
  EXPECT_TRUE(barrier.covers({100.0, 50.0}));
  EXPECT_NEAR(barrier.distance_px(Eigen::Vector2d(100.0, 50.0) + 13.0 * Eigen::Vector2d(0.6, 0.8)), 3.0, 1e-9);
  EXPECT_NEAR(barrier.distance_px(Eigen::Vector2d(100.0, 50.0) + 25.0 * Eigen::Vector2d(-0.8, 0.6)), 5.0, 1e-9);
}

}  // namespace paper_clip_test
}  // namespace mocap::paper_study
