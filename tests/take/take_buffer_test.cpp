#include "take/recorder/take_buffer.h"

#include <gtest/gtest.h>

#include <string>

namespace mocap::take {
namespace take_buffer_test {

Timestamp second(double s) { return from_ns(0) + from_s(s); }

void add(TakeBuffer& buffer, double at_s, const std::string& bytes) {
  buffer.add({BufferedKind::Blobs, 3, second(at_s), bytes});
}

std::string all_of(TakeBuffer& buffer) {
  std::string all;
  for (const BufferedMessage& message : buffer.next(1U << 20U)) all += std::string(message.bytes) + " ";
  return all;
}

TEST(TakeBuffer, GivesWhatCameBeforeAndAfterTheStart) {
  TakeBuffer buffer(10'000, std::chrono::seconds(30));
  for (int i = 0; i < 5; ++i) add(buffer, i, std::to_string(i));

  const auto oldest = buffer.hold(second(2.5));
  const std::string before = all_of(buffer);
  add(buffer, 5.0, "5");

  EXPECT_EQ(oldest, second(3.0));
  EXPECT_EQ(before, "3 4 ");
  EXPECT_EQ(all_of(buffer), "5 ");
  EXPECT_EQ(all_of(buffer), "");
}

TEST(TakeBuffer, ForgetsWhatIsOlderThanItsSpan) {
  TakeBuffer buffer(10'000, std::chrono::seconds(2));
  for (int i = 0; i < 10; ++i) add(buffer, i, std::to_string(i));

  EXPECT_EQ(buffer.hold(second(0.0)), second(7.0));

  EXPECT_EQ(all_of(buffer), "7 8 9 ");
}

TEST(TakeBuffer, KeepsEveryByteThroughManyRoundsOfTheMemory) {
  TakeBuffer buffer(1'000, std::chrono::seconds(30));
  ASSERT_FALSE(buffer.hold(second(0.0)));
  std::string expected, read;

  for (int i = 0; i < 2'000; ++i) {
    const std::string bytes(static_cast<std::size_t>(i * 37 % 211), static_cast<char>('a' + i % 26));
    add(buffer, i, bytes);
    expected += bytes + " ";
    read += all_of(buffer);
  }

  EXPECT_EQ(read, expected);
  EXPECT_EQ(buffer.lost().images, 0U);
}

TEST(TakeBuffer, CountsWhatAFullMemoryTakesFromATake) {
  TakeBuffer buffer(1'000, std::chrono::seconds(30));
  ASSERT_FALSE(buffer.hold(second(0.0)));

  for (int i = 0; i < 50; ++i) add(buffer, i, std::string(100, 'x'));
  std::size_t read = 0;
  while (!all_of(buffer).empty()) ++read;

  EXPECT_EQ(read, 1U);
  EXPECT_GT(buffer.lost().images, 40U);
  EXPECT_EQ(buffer.lost().others, 0U);
}

TEST(TakeBuffer, LosesNothingWithoutATake) {
  TakeBuffer buffer(1'000, std::chrono::seconds(30));

  for (int i = 0; i < 50; ++i) add(buffer, i, std::string(100, 'x'));

  EXPECT_EQ(all_of(buffer), "");
  EXPECT_EQ(buffer.lost().images, 0U);
}

TEST(TakeBuffer, ATakeDoesNotReachBackBeyondABreak) {
  TakeBuffer buffer(10'000, std::chrono::seconds(30));
  add(buffer, 1.0, "old");
  buffer.add({BufferedKind::Break, 0, second(2.0), {}});
  add(buffer, 3.0, "new");

  EXPECT_EQ(buffer.hold(second(0.0)), second(3.0));

  EXPECT_EQ(all_of(buffer), "new ");
}

}  // namespace take_buffer_test
}  // namespace mocap::take
