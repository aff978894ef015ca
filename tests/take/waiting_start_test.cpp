#include "take/recorder/waiting_start.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace mocap::take {
namespace waiting_start_test {

using std::chrono::seconds;
using ::testing::HasSubstr;

constexpr Timestamp kNow = from_ns(1'000'000'000'000);

TimecodeHealth ltc_at(double seconds_since_midnight) {
  TimecodeHealth health;
  health.source = TimecodeSourceKind::Ltc;
  health.format.frames_per_second = 25;
  health.clock = TimecodeClock{
      .format = health.format, .at = kNow, .frames_at = 25.0 * seconds_since_midnight, .frames_per_s = 25.0};
  return health;
}

TakeOrder at_ten_seconds() {
  Timecode ten;
  ten.seconds = 10;
  return {.at_timecode = ten};
}

TEST(WaitingStart, EndsWithTheCountdown) {
  WaitingStart start;
  EXPECT_EQ(*start.begin({.name = "walk", .countdown = seconds(3)}, kNow), "the take starts in 3.0 s");

  EXPECT_FALSE(start.take_due(kNow + seconds(2)));
  const auto due = start.take_due(kNow + seconds(4));

  ASSERT_TRUE(due);
  EXPECT_EQ(due->order.name, "walk");
  EXPECT_EQ(due->at, kNow + seconds(3)) << "also if the disk thread is late";
  EXPECT_FALSE(start.waits());
}

TEST(WaitingStart, StartsATakeAtTheInstantOfTheTimecode) {
  WaitingStart start;
  start.set_timecode(ltc_at(5.0), kNow);
  EXPECT_THAT(*start.begin(at_ten_seconds(), kNow), HasSubstr("in 5.0 s"));

  EXPECT_FALSE(start.take_due(kNow + seconds(4)));
  const auto due = start.take_due(kNow + seconds(6));

  ASSERT_TRUE(due);
  EXPECT_LT(std::abs(to_s(due->at - (kNow + seconds(5)))), 1e-6);
}

TEST(WaitingStart, FollowsASourceThatAppearsWhileItWaits) {
  TimecodeHealth silent = ltc_at(0.0);
  silent.clock.reset();
  WaitingStart start;
  start.set_timecode(silent, kNow);
  ASSERT_TRUE(start.begin(at_ten_seconds(), kNow));
  EXPECT_FALSE(start.take_due(kNow + seconds(100)));

  start.set_timecode(ltc_at(9.0), kNow + seconds(0));

  EXPECT_TRUE(start.take_due(kNow + seconds(1)));
}

TEST(WaitingStart, RefusesATimecodeThatCannotCome) {
  WaitingStart start;
  EXPECT_THAT(start.begin(at_ten_seconds(), kNow).error().message, HasSubstr("source is \"none\""));
  start.set_timecode(ltc_at(0.0), kNow);
  TakeOrder order = at_ten_seconds();
  order.at_timecode->frames = 25;

  EXPECT_THAT(start.begin(order, kNow).error().message, HasSubstr("does not exist at 25 frames per second"));
  EXPECT_FALSE(start.waits());
}

TEST(WaitingStart, IsCancelledOnce) {
  WaitingStart start;
  ASSERT_TRUE(start.begin({.countdown = seconds(3)}, kNow));

  EXPECT_TRUE(start.cancel());
  EXPECT_FALSE(start.cancel());
  EXPECT_FALSE(start.take_due(kNow + seconds(10)));
}

}  // namespace waiting_start_test
}  // namespace mocap::take
