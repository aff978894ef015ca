#include "label/stationary_tracks.h"

#include <gtest/gtest.h>

#include "label/test_tracks.h"

namespace mocap::label {
namespace stationary_tracks_test {

constexpr Duration kStep = std::chrono::milliseconds(10);
constexpr Timestamp kStart = from_ns(1'000'000'000);

TrackedMarkers one_track(double x_m) {
  TrackedMarkers tracked;
  tracked.push_back(test::detected_track(5, {x_m, 0.0, 1.0}));
  return tracked;
}

TEST(StationaryTracks, HaveADurationAndAMeanPosition) {
  StationaryTracks stationary(0.02);

  for (int set = 0; set < 5; ++set) stationary.update(one_track(set % 2 == 0 ? 0.0 : 0.01), kStart + set * kStep);

  EXPECT_EQ(stationary.rest_duration(0), 4 * kStep);
  EXPECT_NEAR(stationary.mean(0).x(), 2 * 0.01 / 5, 1e-12);  // 0.00, 0.01, 0.00, 0.01, 0.00
}

TEST(StationaryTracks, BeginANewPeriodWhereAMotionEnds) {
  StationaryTracks stationary(0.02);
  stationary.update(one_track(0.0), kStart);
  stationary.update(one_track(0.0), kStart + kStep);

  stationary.update(one_track(0.03), kStart + 2 * kStep);

  EXPECT_EQ(stationary.rest_duration(0), Duration{0});
  EXPECT_NEAR(stationary.mean(0).x(), 0.03, 1e-12);
}

TEST(StationaryTracks, KeepTheirMeanWhileTheyCoast) {
  StationaryTracks stationary(0.02);
  stationary.update(one_track(0.0), kStart);
  TrackedMarkers coasting = one_track(0.015);
  coasting[0].state = TrackState::Coasting;

  stationary.update(coasting, kStart + kStep);

  EXPECT_EQ(stationary.rest_duration(0), kStep);
  EXPECT_NEAR(stationary.mean(0).x(), 0.0, 1e-12);
}

}  // namespace stationary_tracks_test
}  // namespace mocap::label
