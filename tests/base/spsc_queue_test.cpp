#include "base/spsc_queue.h"

#include <gtest/gtest.h>

#include <thread>

#include "base/wake_signal.h"

namespace mocap {
namespace spsc_queue_test {

TEST(SpscQueue, ReturnsItemsInTheOrderOfArrival) {
  SpscQueue<int> queue(4);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(queue.try_push(i));

  int got = -1;
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(queue.try_pop(got));
    EXPECT_EQ(got, i);
  }
  EXPECT_FALSE(queue.try_pop(got));
}

TEST(SpscQueue, RefusesANewItemWhenFullForAnyCapacity) {
  SpscQueue<int> queue(3);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(queue.try_push(i));

  EXPECT_FALSE(queue.try_push(3));

  EXPECT_EQ(*queue.front(), 0);
  queue.pop();
  EXPECT_TRUE(queue.try_push(3));
}

TEST(SpscQueue, LosesAndReordersNothingBetweenTwoThreads) {
  constexpr int kItems = 200'000;
  SpscQueue<int> queue(8);
  WakeSignal there_is_work;
  WakeSignal there_is_room;

  std::jthread producer([&] {
    for (int i = 0; i < kItems; ++i) {
      for (;;) {
        const auto ticket = there_is_room.ticket();
        if (queue.try_push(i)) break;
        there_is_room.wait(ticket, std::chrono::seconds(10));
      }
      there_is_work.signal();
    }
  });
  int expected = 0;
  while (expected < kItems) {
    const auto ticket = there_is_work.ticket();
    int got = -1;
    if (!queue.try_pop(got)) {
      there_is_work.wait(ticket, std::chrono::seconds(10));
      continue;
    }
    there_is_room.signal();
    ASSERT_EQ(got, expected);
    ++expected;
  }
}

}  // namespace spsc_queue_test
}  // namespace mocap
