#include "lib/benchmark/point_noise.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "scene/random.h"

namespace mocap::benchmark {
namespace point_noise_test {

// A clip of markers at normal positions with deviations 0.3, 0.2 and 0.5 m about (1, 2, 1), without gaps.
LabelledClip clip_of(std::size_t markers, std::size_t frames) {
  scene::Random random(7);
  LabelledClip clip;
  clip.rate_hz = 100.0;
  clip.marker_set.markers.resize(markers);
  clip.take.markers = markers;
  for (std::size_t i = 0; i < markers * frames; ++i) {
    clip.take.places_m.emplace_back(1.0 + 0.3 * random.normal(), 2.0 + 0.2 * random.normal(),
                                    1.0 + 0.5 * random.normal());
  }
  return clip;
}

std::size_t markers_of(const NoisyFrame& frame) {
  return static_cast<std::size_t>(
      std::ranges::count_if(frame.points, [](const NoisyPoint& p) { return p.marker != NoisyPoint::kNobodys; }));
}

bool has(const NoisyFrame& frame, int marker) {
  return std::ranges::find(frame.points, marker, &NoisyPoint::marker) != frame.points.end();
}

bool same(const std::vector<NoisyFrame>& one, const std::vector<NoisyFrame>& other) {
  return std::ranges::equal(one, other, [](const NoisyFrame& a, const NoisyFrame& b) {
    return a.cut_m == b.cut_m && std::ranges::equal(a.points, b.points, [](const NoisyPoint& p, const NoisyPoint& q) {
             return p.marker == q.marker && p.position_m == q.position_m;
           });
  });
}

// The lengths of all gaps that neither begin nor end with the clip, sorted.
std::vector<int> gaps_of(const std::vector<NoisyFrame>& frames, int markers) {
  std::vector<int> gaps;
  for (int m = 0; m < markers; ++m) {
    int hidden = -1'000'000;
    for (const NoisyFrame& frame : frames) {
      if (!has(frame, m)) {
        ++hidden;
      } else {
        if (hidden > 0) gaps.push_back(hidden);
        hidden = 0;
      }
    }
  }
  std::ranges::sort(gaps);
  return gaps;
}

double hidden_share(const std::vector<NoisyFrame>& frames, std::size_t markers) {
  std::size_t seen = 0;
  for (const NoisyFrame& frame : frames) seen += markers_of(frame);
  return 1.0 - static_cast<double>(seen) / static_cast<double>(markers * frames.size());
}

TEST(PointNoise, IsAFunctionOfClipNoiseAndSeed) {
  const LabelledClip clip = clip_of(20, 100);
  for (const std::string_view name : kNoiseNames) {
    const PointNoise noise = *noise_named(name);

    EXPECT_TRUE(same(add_noise(clip, noise, 5), add_noise(clip, noise, 5))) << name;
    EXPECT_FALSE(same(add_noise(clip, noise, 5), add_noise(clip, noise, 6))) << name;
  }
  EXPECT_FALSE(noise_named("sofa"));
}

TEST(PointNoise, NoneKeepsEveryPointInRandomOrder) {
  LabelledClip clip = clip_of(20, 200);
  clip.take.places_m[3].x() = std::numeric_limits<double>::quiet_NaN();  // a gap of marker 3 in frame 0
  clip.other = {"*1"};
  clip.others_m.assign(200, Eigen::Vector3d(9.0, 9.0, 9.0));

  const auto frames = add_noise(clip, {}, 1);

  EXPECT_EQ(frames[0].points.size(), 20U);  // 19 markers and the other point
  EXPECT_FALSE(has(frames[0], 3));
  double first = 0.0;  // mean index of the marker that comes first
  for (const NoisyFrame& frame : frames) {
    EXPECT_TRUE(has(frame, NoisyPoint::kNobodys));
    first += static_cast<double>(frame.points.front().marker) / 200.0;
  }
  EXPECT_NEAR(first, 9.05, 2.0);  // of -1 to 19; five standard errors
}

TEST(PointNoise, SomaHidesZeroToFourMarkersUniformly) {
  const auto frames = add_noise(clip_of(30, 5000), *noise_named("soma"), 1);

  std::array<int, 6> hidden{};
  for (const NoisyFrame& frame : frames) ++hidden[std::min<std::size_t>(5, 30 - markers_of(frame))];

  for (int n = 0; n < 5; ++n) EXPECT_NEAR(hidden[static_cast<std::size_t>(n)], 1000, 140) << n;  // five sigma
  EXPECT_EQ(hidden[5], 0);
}

TEST(PointNoise, GhostsHaveTheSpreadOfTheFrame) {
  const auto frames = add_noise(clip_of(200, 3000), *noise_named("soma"), 2);

  double count = 0.0;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero(), squares = Eigen::Vector3d::Zero();
  for (const NoisyFrame& frame : frames) {
    for (const NoisyPoint& point : frame.points) {
      if (point.marker != NoisyPoint::kNobodys) continue;
      count += 1.0;
      sum += point.position_m;
      squares += point.position_m.cwiseAbs2();
    }
  }
  const Eigen::Vector3d mean = sum / count;
  const Eigen::Vector3d deviation = (squares / count - mean.cwiseAbs2()).cwiseSqrt();

  EXPECT_NEAR(count / 3000.0, 3.0 * std::pow(8.0 / 9.0, 3), 0.08);  // five standard errors
  EXPECT_LT((mean - Eigen::Vector3d(1.0, 2.0, 1.0)).norm(), 0.05);
  EXPECT_LT((deviation - Eigen::Vector3d(0.3, 0.2, 0.5)).norm(), 0.03);
}

TEST(PointNoise, Hidden5HidesExactlyFiveVisibleMarkers) {
  LabelledClip clip = clip_of(30, 100);
  clip.take.places_m[0].x() = std::numeric_limits<double>::quiet_NaN();

  const auto frames = add_noise(clip, *noise_named("hidden5"), 3);

  EXPECT_EQ(markers_of(frames[0]), 24U);
  for (std::size_t i = 1; i < frames.size(); ++i) EXPECT_EQ(markers_of(frames[i]), 25U);
}

TEST(PointNoise, Cuts50CutsVisibleMarkersInFiftyFrames) {
  const auto frames = add_noise(clip_of(30, 200), *noise_named("cuts50"), 4);

  int cuts = 0;
  for (const NoisyFrame& frame : frames) {
    ASSERT_LE(frame.cut_m.size(), 1U);
    if (frame.cut_m.empty()) continue;
    ++cuts;
    const auto cut = std::ranges::find(frame.points, frame.cut_m[0], &NoisyPoint::position_m);
    ASSERT_NE(cut, frame.points.end());
    EXPECT_NE(cut->marker, NoisyPoint::kNobodys);
  }
  EXPECT_EQ(cuts, 50);
}

TEST(PointNoise, ReversedFramesCutTheSameTracksBetweenTheSameFrames) {
  const auto frames = add_noise(clip_of(30, 200), *noise_named("cuts50"), 4);

  const auto turned = reversed(frames);

  ASSERT_EQ(turned.size(), frames.size());
  int same = 0, later = 0;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    EXPECT_EQ(turned[frames.size() - 1 - i].points.size(), frames[i].points.size());
    if (frames[i].cut_m.empty()) continue;
    const auto cut = std::ranges::find(frames[i].points, frames[i].cut_m[0], &NoisyPoint::position_m);
    const NoisyFrame& before = turned[frames.size() - i];  // frame i - 1
    const auto point = std::ranges::find(before.points, cut->marker, &NoisyPoint::marker);
    const bool cuts = point != before.points.end() && std::ranges::count(before.cut_m, point->position_m) == 1;
    EXPECT_EQ(cuts, point != before.points.end()) << i;
    (cuts ? same : later) += 1;
  }
  std::size_t cuts = 0;
  for (const NoisyFrame& frame : turned) cuts += frame.cut_m.size();
  EXPECT_EQ(cuts, 50U);
  EXPECT_GT(same, 40);
  EXPECT_GT(later, 0) << "no marker was hidden: half of the rule was not tried";
}

TEST(PointNoise, StudioGapsAreRareAndLong) {
  const auto frames = add_noise(clip_of(40, 40'000), *noise_named("studio"), 5);
  const std::vector<int> gaps = gaps_of(frames, 40);

  ASSERT_GT(gaps.size(), 150U);
  EXPECT_GT(hidden_share(frames, 40), 0.004);
  EXPECT_LT(hidden_share(frames, 40), 0.010);
  EXPECT_NEAR(gaps[gaps.size() / 2], 6, 3);
  EXPECT_GE(gaps[gaps.size() * 9 / 10], 60);
  EXPECT_LE(gaps.back(), 800);
  EXPECT_DOUBLE_EQ(studio_gap_frames(0.5), 6.0);
  EXPECT_NEAR(studio_gap_frames(0.9), 115.0, 1e-9);
  EXPECT_NEAR(studio_gap_frames(0.99), 420.0, 1e-9);
}

TEST(PointNoise, UniformHidesItsShareForHalfASecondEach) {
  for (const auto& [name, share] : {std::pair{"uniform10", 0.1}, std::pair{"uniform30", 0.3}}) {
    const auto frames = add_noise(clip_of(40, 5000), *noise_named(name), 6);
    const std::vector<int> gaps = gaps_of(frames, 40);

    EXPECT_NEAR(hidden_share(frames, 40), share, 0.1 * share) << name;
    EXPECT_NEAR(gaps[gaps.size() / 2], 50, 1) << name;
  }
}

TEST(PointNoise, SolverNoiseHidesAndShiftsAlikeSharesOfEachFrame) {
  const LabelledClip clip = clip_of(100, 2000);
  const std::vector<NoisyFrame> frames = add_noise(clip, *noise_named("solver"), 3);

  double hidden = 0.0, shifted = 0.0, most = 0.0;
  for (const NoisyFrame& frame : frames) {
    const double left = static_cast<double>(markers_of(frame)), points = static_cast<double>(frame.points.size());
    hidden += 100.0 - points;
    shifted += points - left;
    most = std::max(most, 100.0 - points);
  }
  // The mean of |N(0, 0.1)|, cut at 0.2, is 0.0783 (numerically).
  EXPECT_NEAR(hidden / 2000.0, 7.83, 0.4);
  EXPECT_NEAR(shifted / 2000.0, 7.83, 0.4);
  EXPECT_LT(most, 45.0);  // 20 expected of 100, with deviation 4
}

}  // namespace point_noise_test
}  // namespace mocap::benchmark
