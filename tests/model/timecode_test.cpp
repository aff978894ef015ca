#include "model/clock/timecode.h"

#include <gtest/gtest.h>

namespace mocap {
namespace timecode_test {

TEST(Timecode, CountsDropFrames) {
  Timecode drop{0, 0, 59, 29, 30, true};
  EXPECT_EQ(frames_of(drop), 1799);
  EXPECT_EQ(text_of(timecode_of(1800, drop)), "00:01:00;02");
  EXPECT_EQ(frames_of(Timecode{0, 10, 0, 0, 30, true}), 17982);
  for (std::int64_t frame = 0; frame < 2'589'408; frame += 7) ASSERT_EQ(frames_of(timecode_of(frame, drop)), frame);
  EXPECT_EQ(text_of(timecode_of(-1, drop)), "23:59:59;29");
  EXPECT_EQ(text_of(timecode_of(25, Timecode{0, 0, 0, 0, 25})), "00:00:01:00");
}

TEST(Timecode, RefusesTextsThatAreNone) {
  const Timecode like{0, 0, 0, 0, 25};
  EXPECT_TRUE(parse_timecode("10:00:00:24", like));
  for (const char* text : {"10:00:00:25", "24:00:00:00", "1:2:3", "10:00:00:00x", ""}) {
    EXPECT_FALSE(parse_timecode(text, like)) << text;
  }
}

TEST(Timecode, KnowsTheNumbersThatDropFrameSkips) {
  EXPECT_FALSE(is_valid({0, 1, 0, 1, 30, true}));
  EXPECT_TRUE(is_valid({0, 1, 0, 2, 30, true}));
  EXPECT_TRUE(is_valid({0, 10, 0, 0, 30, true}));
  EXPECT_TRUE(is_valid({0, 1, 0, 1, 30, false}));
}

TEST(Timecode, RefusesNumbersOutOfRange) {
  EXPECT_FALSE(is_valid({24, 0, 0, 0, 25}));
  EXPECT_FALSE(is_valid({0, 60, 0, 0, 25}));
  EXPECT_FALSE(is_valid({0, 0, 60, 0, 25}));
  EXPECT_FALSE(is_valid({0, 0, 0, 25, 25}));
  EXPECT_FALSE(is_valid({0, 0, 0, 0, 0}));
  EXPECT_FALSE(is_valid({0, 0, 0, 0, 4'000'000'000}));
}

TEST(Timecode, KnowsItsRealRate) {
  EXPECT_DOUBLE_EQ(rate_hz({0, 0, 0, 0, 25}), 25.0);
  EXPECT_DOUBLE_EQ(rate_hz({0, 0, 0, 0, 30, true}), 30.0 / 1.001);
  EXPECT_DOUBLE_EQ(rate_hz({0, 0, 0, 0, 24, false, true}), 24.0 / 1.001);
}

}  // namespace timecode_test
}  // namespace mocap
