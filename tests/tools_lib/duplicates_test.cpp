#include "lib/benchmark/duplicates.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

#include "lib/benchmark/point_noise.h"

namespace mocap::benchmark {
namespace duplicates_test {

using Eigen::Vector3d;
using Flags = std::vector<bool>;

const Vector3d kGap = Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());

// Two markers, 1 m apart, and one other point with these distances to the first marker; negative: a gap.
LabelledClip clip_of(const std::vector<double>& apart_m) {
  LabelledClip clip;
  clip.rate_hz = 100.0;
  clip.marker_set.markers.resize(2);
  clip.take.markers = 2;
  clip.other = {"*1"};
  for (const double distance_m : apart_m) {
    clip.take.places_m.emplace_back(0.0, 0.0, 0.0);
    clip.take.places_m.emplace_back(1.0, 0.0, 0.0);
    clip.others_m.push_back(distance_m < 0.0 ? kGap : Vector3d(0.0, distance_m, 0.0));
  }
  return clip;
}

TEST(Duplicates, APointThatMeetsAMarkerIsADuplicateUntilItsGap) {
  const Duplicates found = find_duplicates(clip_of({0.05, 0.004, 0.03, -1.0, 0.05}));

  EXPECT_EQ(found.others, (Flags{true, true, true, false, false}));
  EXPECT_EQ(found.markers, (Flags{true, false, true, false, true, false, false, false, false, false}));
}

TEST(Duplicates, APointBesideAMarkerIsAMarkerOfItsOwn) {
  const Duplicates found = find_duplicates(clip_of({0.02, 0.011, 0.02}));

  EXPECT_EQ(found.others, Flags(3));
  EXPECT_EQ(found.markers, Flags(6));
}

TEST(Duplicates, AMarkerInAGapMeetsNothing) {
  LabelledClip clip = clip_of({0.02, 0.001, 0.02});
  clip.take.places_m[2] = kGap;

  EXPECT_EQ(find_duplicates(clip).others, Flags(3));
}

TEST(Duplicates, AreMarkedInTheFramesWithNoise) {
  const std::vector<NoisyFrame> frames = add_noise(clip_of({0.004, -1.0}), {}, 1);

  for (const NoisyPoint& point : frames[0].points) EXPECT_EQ(point.is_duplicate, point.marker != 1);
  for (const NoisyPoint& point : frames[1].points) EXPECT_FALSE(point.is_duplicate);
}

TEST(Duplicates, AShiftedPointIsAGhostWhoseTruthIsKnown) {
  const std::vector<NoisyFrame> frames = add_noise(clip_of(std::vector<double>(200, 0.004)), *noise_named("solver"), 1);

  std::size_t ghosts = 0;
  for (const NoisyFrame& frame : frames) {
    for (const NoisyPoint& point : frame.points) {
      if (point.marker == NoisyPoint::kNobodys && point.position_m != Vector3d(0.0, 0.004, 0.0)) {
        EXPECT_FALSE(point.is_duplicate);
        ++ghosts;
      }
    }
  }
  EXPECT_GT(ghosts, 0U);
}

}  // namespace duplicates_test
}  // namespace mocap::benchmark
