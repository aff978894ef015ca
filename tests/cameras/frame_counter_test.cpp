#include "cameras/clock/frame_counter.h"

#include <gtest/gtest.h>

namespace mocap::cameras {
namespace frame_counter_test {

std::uint64_t step(std::uint64_t from, std::uint64_t to) {
  FrameCounter counter;
  const std::uint64_t first = counter.number_of(from);
  return counter.number_of(to) - first;
}

TEST(FrameCounter, KeepsTheGapsOfTheIds) {
  EXPECT_EQ(step(7, 8), 1U);
  EXPECT_EQ(step(7, 12), 5U);
}

TEST(FrameCounter, WrapsSixteenBitIdsThatSkipZero) {
  EXPECT_EQ(step(65535, 1), 1U);
  EXPECT_EQ(step(65534, 3), 4U);
}

TEST(FrameCounter, WrapsThirtyTwoBitIds) { EXPECT_EQ(step(0xFFFF'FFFF, 0), 1U); }

TEST(FrameCounter, CountsARepeatedOrEarlierIdAsTheNext) {
  EXPECT_EQ(step(500, 500), 1U);
  EXPECT_EQ(step(500, 1), 1U);
}

}  // namespace frame_counter_test
}  // namespace mocap::cameras
