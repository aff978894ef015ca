#include "synchronise/exposure_watch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace mocap::synchronise {
namespace exposure_watch_test {

using std::chrono::microseconds;

/// Timing of a camera's exposures relative to the common trigger.
struct Clockwork {
  double offset_us = 0.0;
  double drift_us_s = 0.0;
  double rate_hz = 100.0;
  double lost = 0.03;
};

constexpr double kJitter_us = 40.0;

/// Returns a watch after `seconds` of frames with time stamp jitter and lost images.
ExposureWatch watched(const std::vector<Clockwork>& cameras, double seconds, unsigned seed) {
  struct Event {
    Timestamp at;
    CameraId camera;
  };
  std::mt19937 random(seed);
  std::normal_distribution<double> jitter_us(0.0, kJitter_us);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  std::vector<Event> events;
  for (std::uint32_t c = 0; c < cameras.size(); ++c) {
    const Clockwork& own = cameras[c];
    for (double t_s = 0.0; t_s < seconds; t_s += 1.0 / own.rate_hz) {
      if (share(random) < own.lost) continue;
      const double off_us = own.offset_us + own.drift_us_s * t_s + jitter_us(random);
      events.push_back({from_ns(5'000'000'000) + from_s(t_s + 1e-6 * off_us), {c}});
    }
  }
  std::ranges::stable_sort(events, {}, &Event::at);
  ExposureWatch watch(microseconds(500), cameras.size());
  for (const Event& event : events) watch.see(event.camera, event.at);
  watch.assess();
  return watch;
}

TEST(ExposureWatch, ReportsTriggeredCamerasAsSynchronisedWithTheirOffsets) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const ExposureWatch watch = watched({{-60.0}, {-20.0}, {20.0}, {60.0}}, 12.0, seed);
    for (std::uint32_t c = 0; c < 4; ++c) {
      const CameraTiming& timing = watch.timing({c});
      ASSERT_TRUE(timing.is_known);
      EXPECT_TRUE(timing.synchronised) << "camera " << c << " seed " << seed;
      // Jitter of 40 us over about 500 effective frames; the error is largest at the end of the fitted line.
      EXPECT_NEAR(to_us(timing.offset), -60.0 + 40.0 * c, 15.0);
      EXPECT_NEAR(timing.drift_us_s, 0.0, 3.0);
      EXPECT_NEAR(timing.rate_hz, 100.0, 1.0);
      // Jitter of the camera plus that of the reference camera; the reference camera has none relative to itself.
      const bool is_clock = timing.jitter < microseconds(1);
      EXPECT_NEAR(to_us(timing.jitter), is_clock ? 0.0 : 1.41 * kJitter_us, 0.3 * kJitter_us);
    }
  }
}

TEST(ExposureWatch, DetectsTheFreeRunningCamera) {
  for (std::uint32_t free = 0; free < 4; ++free) {
    std::vector<Clockwork> cameras(4);
    cameras[free] = {.offset_us = 2700.0, .drift_us_s = 40.0};
    const ExposureWatch watch = watched(cameras, 10.0, 7 + free);
    for (std::uint32_t c = 0; c < 4; ++c) EXPECT_EQ(watch.timing({c}).synchronised, c != free);
    EXPECT_NEAR(to_us(watch.timing({free}).offset), 2700.0 + 40.0 * 10.0, 20.0);
    EXPECT_NEAR(watch.timing({free}).drift_us_s, 40.0, 3.0);
  }
}

TEST(ExposureWatch, DetectsADriftingCamera) {
  const ExposureWatch watch = watched({{}, {}, {.offset_us = -100.0, .drift_us_s = 20.0}}, 10.0, 3);

  EXPECT_TRUE(watch.timing({0}).synchronised);
  EXPECT_TRUE(watch.timing({1}).synchronised);
  EXPECT_FALSE(watch.timing({2}).synchronised);
  EXPECT_LT(std::abs(to_us(watch.timing({2}).offset)), 200.0);
}

TEST(ExposureWatch, DetectsACameraWithAnotherRate) {
  const ExposureWatch watch = watched({{}, {}, {.rate_hz = 99.0}}, 10.0, 4);

  EXPECT_TRUE(watch.timing({0}).synchronised);
  EXPECT_FALSE(watch.timing({2}).synchronised);
  EXPECT_NEAR(watch.timing({2}).rate_hz, 99.0, 0.5);
}

TEST(ExposureWatch, FindsNoGroupIfAllCamerasRunFree) {
  const ExposureWatch watch = watched({{0.0, 15.0}, {2300.0, -22.0}, {-4100.0, 41.0}, {4300.0, -60.0}}, 10.0, 5);

  int alone = 0;
  for (std::uint32_t c = 0; c < 4; ++c) alone += watch.timing({c}).synchronised ? 0 : 1;
  EXPECT_EQ(alone, 3) << "one is what the others are compared with";
}

TEST(ExposureWatch, DoesNotJudgeACameraThatHasJustStarted) {
  ExposureWatch watch = watched({{}, {}}, 1.0, 6);
  EXPECT_FALSE(watch.timing({0}).is_known);

  watch = watched({{}, {}}, 5.0, 6);
  EXPECT_TRUE(watch.timing({1}).is_known);
  watch.forget({1});
  EXPECT_FALSE(watch.timing({1}).is_known);
}

TEST(ExposureWatch, ReplacesASilentReferenceCamera) {
  ExposureWatch watch(microseconds(500), 3);
  for (int i = 0; i < 2000; ++i) {
    const Timestamp at = from_ns(1'000'000'000) + microseconds(10'000 * i);
    if (i < 500) watch.see({0}, at);
    watch.see({1}, at);
    watch.see({2}, at + microseconds(3000));
  }
  watch.assess();

  EXPECT_FALSE(watch.timing({0}).is_known);
  EXPECT_TRUE(watch.timing({1}).synchronised);
  EXPECT_FALSE(watch.timing({2}).synchronised);
  EXPECT_NEAR(to_us(watch.timing({2}).offset), 3000.0, 5.0);
}

}  // namespace exposure_watch_test
}  // namespace mocap::synchronise
