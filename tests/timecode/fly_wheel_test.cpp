#include "timecode/fly_wheel.h"

#include <gtest/gtest.h>

#include <random>

#include "ltc_signal.h"

namespace mocap::timecode {
namespace fly_wheel_test {

using testing::at;
using testing::kBegin;
using testing::with_rate;

// A source of frames with known truth.
struct Source {
  Timecode start;
  double drift = 0.0;
  double jitter_s = 0.0;
  std::mt19937 random{7};

  Timestamp time_of(int frame) const { return kBegin + from_s(frame / (rate_hz(start) * (1.0 + drift))); }
  LtcFrame frame(int number) {
    std::normal_distribution<double> jitter(0.0, 1.0);
    return {timecode_of(frames_of(start) + number, start), time_of(number) + from_s(jitter_s * jitter(random)), false};
  }
  double position(Timestamp at) const {
    return static_cast<double>(frames_of(start)) + to_s(at - kBegin) * rate_hz(start) * (1.0 + drift);
  }
};

double error_frames(const FlyWheel& wheel, const Source& source, Timestamp at) {
  return position_at(*wheel.clock(), at) - source.position(at);
}

TEST(FlyWheel, LocksAfterFiveFramesThatAgree) {
  Source source{at(with_rate(25), 10, 0, 0, 0)};
  FlyWheel wheel(source.start);

  for (int i = 0; i < FlyWheel::kLockFrames - 1; ++i) EXPECT_EQ(wheel.add(source.frame(i)), LtcVerdict::Disagrees);
  EXPECT_FALSE(wheel.clock());
  EXPECT_EQ(wheel.add(source.frame(4)), LtcVerdict::Accepted);

  EXPECT_EQ(text_of(*timecode_at(*wheel.clock(), source.time_of(4))), "10:00:00:04");
}

TEST(FlyWheel, FollowsADriftOf200PpmWithinATenthOfAMillisecond) {
  for (const double drift : {200e-6, -200e-6}) {
    Source source{at(with_rate(30), 10, 0, 0, 0), drift, 100e-6};
    FlyWheel wheel(source.start);
    for (int i = 0; i < 30 * 60; ++i) {
      wheel.add(source.frame(i));
      if (i < 30 * 20) continue;  // the filter remembers about 10 s
      ASSERT_LT(std::abs(error_frames(wheel, source, source.time_of(i))), 0.003) << i;
    }
    EXPECT_NEAR(wheel.drift_ppm(), 1e6 * drift, 10.0);
  }
}

TEST(FlyWheel, LeavesOutSingleJumpsAndWrongTimes) {
  Source source{at(with_rate(25), 10, 0, 0, 0)};
  FlyWheel wheel(source.start);
  for (int i = 0; i < 500; ++i) {
    LtcFrame frame = source.frame(i);
    if (i > 10 && i % 7 == 0) frame.timecode.hours = 3;
    if (i > 10 && i % 11 == 0) frame.starts_at += std::chrono::milliseconds(15);
    wheel.add(frame);
    if (i > 10) {
      ASSERT_LT(std::abs(error_frames(wheel, source, source.time_of(i))), 0.02) << i;
    }
  }
  EXPECT_EQ(wheel.jumps(), 0U);
  EXPECT_GT(wheel.rejected(), 100U);
}

TEST(FlyWheel, CoastsThroughADropoutOfAMinute) {
  Source source{at(with_rate(30), 10, 0, 0, 0), 150e-6, 100e-6};
  FlyWheel wheel(source.start);
  for (int i = 0; i < 30 * 30; ++i) wheel.add(source.frame(i));
  const int later = 30 * 90;

  EXPECT_LT(std::abs(error_frames(wheel, source, source.time_of(later))), 0.05);
  EXPECT_EQ(wheel.add(source.frame(later)), LtcVerdict::Accepted);
}

TEST(FlyWheel, FollowsARealJumpAfterFiveFrames) {
  Source before{at(with_rate(25), 10, 0, 0, 0)};
  FlyWheel wheel(before.start);
  for (int i = 0; i < 100; ++i) wheel.add(before.frame(i));
  Source after{at(with_rate(25), 1, 0, 0, 0)};
  for (int i = 100; i < 104; ++i) EXPECT_EQ(wheel.add(after.frame(i)), LtcVerdict::Disagrees);

  EXPECT_LT(std::abs(error_frames(wheel, before, before.time_of(104))), 0.02);
  EXPECT_EQ(wheel.add(after.frame(104)), LtcVerdict::Accepted);
  EXPECT_EQ(text_of(*timecode_at(*wheel.clock(), after.time_of(104))), "01:00:04:04");
  EXPECT_EQ(wheel.jumps(), 1U);
}

TEST(FlyWheel, PassesMidnightWithoutAJump) {
  for (const Timecode& format : {with_rate(25), with_rate(30, true), with_rate(24, false, true)}) {
    Source source{timecode_of(-100, format)};
    FlyWheel wheel(format);
    for (int i = 0; i < 200; ++i) wheel.add(source.frame(i));

    EXPECT_EQ(wheel.jumps(), 0U);
    EXPECT_EQ(wheel.accepted(), 196U);
    EXPECT_EQ(frames_of(*timecode_at(*wheel.clock(), source.time_of(199))), 99);
  }
}

TEST(FlyWheel, NamesFramesThatCannotBe) {
  FlyWheel wheel(with_rate(25));
  Source source{at(with_rate(25), 10, 0, 0, 0)};
  LtcFrame reverse = source.frame(0), drop = source.frame(0), late = source.frame(0);
  reverse.reverse = true;
  drop.timecode.drop_frame = true;
  late.timecode.frames = 25;

  EXPECT_EQ(wheel.add(reverse), LtcVerdict::Reverse);
  EXPECT_EQ(wheel.add(drop), LtcVerdict::OtherCounting);
  EXPECT_EQ(wheel.add(late), LtcVerdict::Impossible);
  EXPECT_FALSE(wheel.clock());
}

TEST(FlyWheel, DoesNotFollowAnotherRateButMeasuresIt) {
  for (const std::uint32_t other : {24U, 30U}) {
    Source source{at(with_rate(other), 10, 0, 0, 0)};
    FlyWheel wheel(with_rate(25));
    int heard = 0;
    for (int i = 0; i < 500; ++i) {
      wheel.add(source.frame(i));
      if (const auto rate = wheel.heard_rate_hz()) {
        ASSERT_NEAR(*rate, other, 0.01);
        ++heard;
      }
    }
    EXPECT_GT(heard, 100);
    EXPECT_FALSE(wheel.clock());
  }
}

TEST(FlyWheel, IsNotMovedByFramesOfThePast) {
  Source source{at(with_rate(25), 10, 0, 0, 0)};
  FlyWheel wheel(source.start);
  for (int i = 0; i < 50; ++i) wheel.add(source.frame(i));

  for (int i = 0; i < 20; ++i) EXPECT_NE(wheel.add(source.frame(49)), LtcVerdict::Accepted);
  EXPECT_LT(std::abs(error_frames(wheel, source, source.time_of(60))), 0.02);
}

TEST(FlyWheel, SurvivesRandomFrames) {
  std::mt19937 random(11);
  FlyWheel wheel(with_rate(30, true));
  Timestamp now = kBegin;
  for (int i = 0; i < 100'000; ++i) {
    LtcFrame frame;
    const auto up_to = [&](unsigned most) { return static_cast<std::uint32_t>(random() % (most + 1)); };
    frame.timecode = {up_to(63), up_to(127), up_to(127), up_to(63), 30, up_to(1) == 0};
    now += Duration(static_cast<std::int64_t>(random() % 100'000'000) - 20'000'000);
    frame.starts_at = now;
    wheel.add(frame);
    if (wheel.clock()) {
      ASSERT_TRUE(std::isfinite(wheel.clock()->frames_at));
    }
  }
  EXPECT_EQ(wheel.accepted() + wheel.rejected(), 100'000U);
}

}  // namespace fly_wheel_test
}  // namespace mocap::timecode
