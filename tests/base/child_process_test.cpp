#include "base/child_process.h"

#include <gmock/gmock.h>

#include <csignal>

namespace mocap {
namespace child_process_test {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<std::string> all_lines(ChildProcess& process) {
  std::vector<std::string> all;
  while (const auto lines = process.read()) all.insert(all.end(), lines->begin(), lines->end());
  return all;
}

TEST(ChildProcess, GivesTheLinesOfBothOutputs) {
  auto process = ChildProcess::start({"sh", "-c", "echo one; echo two >&2; printf three"});
  ASSERT_TRUE(process) << process.error().message;

  EXPECT_THAT(all_lines(*process), ElementsAre("one", "two", "three"));
  EXPECT_TRUE(process->wait().well());
}

TEST(ChildProcess, TellsExitCodeAndSignal) {
  auto failing = ChildProcess::start({"sh", "-c", "exit 65"});
  auto sleeping = ChildProcess::start({"sleep", "1000"});
  ASSERT_TRUE(failing && sleeping);
  sleeping->send(SIGKILL);

  const ProcessEnd failed = failing->wait(), killed = sleeping->wait();

  EXPECT_EQ(failed.exit_code, 65);
  EXPECT_EQ(failed.signal, 0);
  EXPECT_EQ(killed.signal, SIGKILL);
  EXPECT_FALSE(killed.well());
}

TEST(ChildProcess, NamesAProgramThatDoesNotExist) {
  const auto refused = ChildProcess::start({"mocap-none"});

  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::NotFound);
  EXPECT_THAT(refused.error().message, HasSubstr("mocap-none"));
}

TEST(ChildProcess, GivesTheWholeOutputOfACommand) {
  const auto output = ChildProcess::output_of({"sh", "-c", "echo one; printf two; exit 1"}, std::chrono::minutes(1));

  ASSERT_TRUE(output) << output.error().message;
  EXPECT_EQ(*output, "one\ntwo\n");
}

TEST(ChildProcess, DoesNotWaitForACommandThatDoesNotEnd) {
  const auto silent = ChildProcess::output_of({"sleep", "1000"}, std::chrono::milliseconds(20));

  ASSERT_FALSE(silent);
  EXPECT_EQ(silent.error().code, ErrorCode::Timeout);
}

TEST(ChildProcess, IsKilledAtTheEndOfItsObject) {
  pid_t id = 0;
  {
    auto process = ChildProcess::start({"sleep", "1000"});
    ASSERT_TRUE(process);
    id = process->id();
  }

  EXPECT_EQ(::kill(id, 0), -1);
}

TEST(ChildProcess, CutsAnEndlessLine) {
  auto process = ChildProcess::start({"sh", "-c", "head -c 200000 /dev/zero | tr '\\0' x"});
  ASSERT_TRUE(process);

  const std::vector<std::string> lines = all_lines(*process);

  EXPECT_GE(lines.size(), 3U);
  std::size_t bytes = 0;
  for (const std::string& line : lines) bytes += line.size();
  EXPECT_EQ(bytes, 200000U);
}

}  // namespace child_process_test
}  // namespace mocap
