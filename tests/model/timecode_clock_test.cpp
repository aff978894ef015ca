#include "model/clock/timecode_clock.h"

#include <gtest/gtest.h>

namespace mocap {
namespace timecode_clock_test {

constexpr Timestamp kStart = from_ns(1'000'000'000'000);

TimecodeClock clock_at(const Timecode& start, double exposures_per_s = 0.0) {
  TimecodeClock clock;
  clock.format = start;
  clock.at = kStart;
  clock.frames_at = static_cast<double>(frames_of(start));
  clock.frames_per_s = rate_hz(start);
  clock.exposures_per_s = exposures_per_s;
  return clock;
}

std::string text_at(const TimecodeClock& clock, double after_s) {
  const auto timecode = timecode_at(clock, kStart + from_s(after_s));
  return timecode ? text_of(*timecode) + "." + std::to_string(timecode->subframe) : "none";
}

TEST(TimecodeClock, CountsFramesAndSubframes) {
  const TimecodeClock clock = clock_at({10, 0, 0, 28, 30}, 120.0);

  // Exposures 1 ms after the trigger, which is locked to the timecode.
  EXPECT_EQ(text_at(clock, 0.001), "10:00:00:28.0");
  EXPECT_EQ(text_at(clock, 0.001 + 3.0 / 120), "10:00:00:28.3");
  EXPECT_EQ(text_at(clock, 0.001 + 4.0 / 120), "10:00:00:29.0");
  EXPECT_EQ(text_at(clock, 0.001 + 8.0 / 120), "10:00:01:00.0");
}

TEST(TimecodeClock, GivesEveryExposureOfAFrameItsOwnSubframe) {
  const TimecodeClock clock = clock_at({10, 0, 0, 0, 24}, 100.0);  // 4.17 exposures in a frame
  std::string before;
  for (int i = 0; i < 500; ++i) {
    const std::string now = text_at(clock, 0.003 + i / 100.0);
    ASSERT_NE(now, before) << i;
    before = now;
  }
}

TEST(TimecodeClock, ToleratesTheJitterOfExposuresAtTheStartOfAFrame) {
  const TimecodeClock clock = clock_at({10, 0, 0, 0, 30}, 120.0);

  EXPECT_EQ(text_at(clock, 1.0 - 100e-6), "10:00:01:00.0");
  EXPECT_EQ(text_at(clock, 1.0 + 100e-6), "10:00:01:00.0");
  EXPECT_EQ(text_at(clock, 1.0 - 2e-3), "10:00:00:29.3");
}

TEST(TimecodeClock, PassesMidnight) {
  EXPECT_EQ(text_at(clock_at({23, 59, 59, 24, 25}), 0.041), "00:00:00:00.0");
  EXPECT_EQ(text_at(clock_at({23, 59, 59, 29, 30, true}), 0.034), "00:00:00;00.0");
  EXPECT_EQ(text_at(clock_at({0, 0, 0, 0, 25}), -0.05), "23:59:59:23.0");
}

TEST(TimecodeClock, SkipsTheNumbersOfDropFrame) {
  const TimecodeClock clock = clock_at({1, 0, 59, 29, 30, true});

  EXPECT_EQ(text_at(clock, 0.001), "01:00:59;29.0");
  EXPECT_EQ(text_at(clock, 0.001 + 1.001 / 30), "01:01:00;02.0");
}

TEST(TimecodeClock, HasNoTimecodeAfterItsEnd) {
  TimecodeClock clock = clock_at({10, 0, 0, 0, 25});
  clock.valid_until = kStart + std::chrono::seconds(1);

  EXPECT_EQ(text_at(clock, 1.0), "10:00:01:00.0");
  EXPECT_EQ(text_at(clock, 1.001), "none");
}

TEST(TimecodeClock, FindsTheTimeOfATimecode) {
  const TimecodeClock clock = clock_at({23, 59, 50, 0, 25});

  EXPECT_NEAR(to_s(time_of(clock, {23, 59, 55, 5, 25}, kStart) - kStart), 5.2, 1e-6);
  EXPECT_NEAR(to_s(time_of(clock, {0, 0, 0, 0, 25}, kStart) - kStart), 10.0, 1e-6);
  EXPECT_NEAR(to_s(time_of(clock, {23, 59, 49, 0, 25}, kStart) - kStart), 86399.0, 1e-6);  // tomorrow
}

}  // namespace timecode_clock_test
}  // namespace mocap
