#include "trigger/repeat_memory.h"

#include <gtest/gtest.h>

namespace mocap::trigger {
namespace repeat_memory_test {

using std::chrono::seconds;

Request start(const std::string& packet_id, const std::string& name = "walk") {
  return {.verb = Verb::Start, .name = name, .packet_id = packet_id};
}

TEST(RepeatMemory, FindsARepeatOfTheSameSenderVerbAndPacketId) {
  RepeatMemory memory;
  const std::uint64_t id = memory.add(1, start("7"), from_ns(0));

  ASSERT_NE(memory.find(1, start("7"), from_ns(1)), nullptr);
  EXPECT_EQ(memory.find(1, start("7"), from_ns(1))->id, id);
  EXPECT_EQ(memory.find(2, start("7"), from_ns(1)), nullptr);
  EXPECT_EQ(memory.find(1, start("8"), from_ns(1)), nullptr);
  EXPECT_EQ(memory.find(1, start("7", "run"), from_ns(1)), nullptr);
  Request stop = start("7");
  stop.verb = Verb::Stop;
  EXPECT_EQ(memory.find(1, stop, from_ns(1)), nullptr);
}

TEST(RepeatMemory, ForgetsAfterAMinute) {
  RepeatMemory memory;
  memory.add(1, start("7"), from_ns(0));

  EXPECT_NE(memory.find(1, start("7"), Timestamp(seconds(60))), nullptr);
  EXPECT_EQ(memory.find(1, start("7"), Timestamp(seconds(61))), nullptr);
}

TEST(RepeatMemory, KeepsTheNewestRequestsOnly) {
  RepeatMemory memory;
  for (int i = 0; i < 3000; ++i) memory.add(1, start(std::to_string(i)), from_ns(i));

  EXPECT_EQ(memory.find(1, start("0"), from_ns(3000)), nullptr);
  EXPECT_NE(memory.find(1, start("2999"), from_ns(3000)), nullptr);
  EXPECT_NE(memory.find(1, start("952"), from_ns(3000)), nullptr);
}

TEST(RepeatMemory, ForgetsARequestOnDemand) {
  RepeatMemory memory;
  const std::uint64_t id = memory.add(1, start("7"), from_ns(0));
  memory.find(id)->answers.push_back("yes");
  EXPECT_EQ(memory.find(1, start("7"), from_ns(1))->answers.size(), 1U);

  memory.forget(id);

  EXPECT_EQ(memory.find(id), nullptr);
  EXPECT_EQ(memory.find(1, start("7"), from_ns(1)), nullptr);
}

}  // namespace repeat_memory_test
}  // namespace mocap::trigger
