// mocapctl take ..., as a process.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <sys/file.h>
#include <sys/inotify.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "support/places.h"
#include "support/shell.h"
#include "support/temporary_folder.h"
#include "take/example_take.h"

namespace mocap::ctl {
namespace take_command_test {

using ::testing::HasSubstr;

struct Ended {
  int exit = -1;
  std::string out;
};

class TakeCommand : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_NO_FATAL_FAILURE(take::record_example(path(), 60)); }

  std::filesystem::path path() const { return folder_.path() / "walk-3.mcap"; }

  // Runs "mocapctl take WORDS" in the folder of the take, without a terminal.
  Ended run(const std::string& words) const {
    const std::string command = "cd " + support::quoted(folder_.path()) + " && " +
                                support::quoted(support::program_folder() + "/mocapctl") + " take " + words +
                                " 2>&1 </dev/null";
    Ended ended;
    FILE* pipe = ::popen(command.c_str(), "r");
    std::array<char, 4096> block;
    for (std::size_t count; (count = std::fread(block.data(), 1, block.size(), pipe)) > 0;)
      ended.out.append(block.data(), count);
    ended.exit = WEXITSTATUS(::pclose(pipe));
    return ended;
  }

  void cut_off() const { std::filesystem::resize_file(path(), std::filesystem::file_size(path()) * 2 / 3); }

  support::TemporaryFolder folder_;
};

TEST_F(TakeCommand, ListsAndShowsTakes) {
  const Ended list = run("list");
  const Ended show = run("show walk-3.mcap --json");

  EXPECT_EQ(list.exit, 0);
  EXPECT_THAT(list.out, HasSubstr("walk-3.mcap"));
  ASSERT_EQ(show.exit, 0) << show.out;
  const auto json = nlohmann::json::parse(show.out);
  EXPECT_EQ(json.at("state"), "complete");
  EXPECT_NEAR(json.at("seconds"), 59 / 120.0, 1e-3);
  EXPECT_EQ(json.at("topics").at("snapshot").at("messages"), 60);
  EXPECT_EQ(json.at("info").at("slate"), "12A");
}

// The recorder ends a take whose file is not there, if only for a moment.
TEST_F(TakeCommand, LeavesATakeThatIsBeingRecordedWhereItIs) {
  const int recorder = ::open(path().c_str(), O_RDWR), moves = ::inotify_init1(IN_NONBLOCK);
  ASSERT_EQ(::flock(recorder, LOCK_EX), 0);
  ASSERT_GE(::inotify_add_watch(moves, folder_.path().c_str(), IN_MOVED_FROM), 0);

  const Ended refused = run("rename walk-3.mcap best");

  std::array<char, 4096> move;
  EXPECT_EQ(::read(moves, move.data(), move.size()), -1) << "the file was renamed";
  EXPECT_NE(refused.exit, 0);
  EXPECT_THAT(refused.out, HasSubstr("is being recorded; stop the take first"));
  ::close(moves);
  ::close(recorder);
}

TEST_F(TakeCommand, EditsNotesRatingAndName) {
  EXPECT_EQ(run("note 'prop fell' walk-3.mcap").exit, 0);
  EXPECT_EQ(run("rate 4 walk-3.mcap").exit, 0);
  EXPECT_EQ(run("rate 6 walk-3.mcap").exit, 64);
  EXPECT_EQ(run("rename walk-3.mcap best").exit, 0);

  const auto json = nlohmann::json::parse(run("show best.mcap --json").out);
  EXPECT_EQ(json.at("info").at("notes"), "prop fell");
  EXPECT_EQ(json.at("info").at("rating"), "4");
  EXPECT_EQ(json.at("info").at("name"), "best");
  EXPECT_EQ(run("verify best.mcap").out, "best.mcap: valid\n");
}

TEST_F(TakeCommand, RefusesNotesThatAreNotUtf8) {
  const Ended refused = run("note \"$(printf 'caf\\351')\" walk-3.mcap");

  EXPECT_EQ(refused.exit, 65);
  EXPECT_THAT(refused.out, HasSubstr("notes: byte 3 is not UTF-8"));
}

// A take of another program.
TEST_F(TakeCommand, PrintsNoControlCharacterOfATakeAndAlwaysJson) {
  take::TakeStart start = take::example_start();
  start.info.others["colour"] = "red\x1b[2J \xff";
  auto writer = take::TakeWriter::create(folder_.path() / "other.mcap", start);
  ASSERT_TRUE(writer) << writer.error().message;
  ASSERT_TRUE((*writer)->finish(start.info));

  const Ended text = run("show other.mcap"), json = run("show other.mcap --json");

  EXPECT_EQ(text.exit, 0);
  EXPECT_EQ(text.out.find('\x1b'), std::string::npos);
  EXPECT_THAT(text.out, HasSubstr("red [2J"));
  ASSERT_EQ(json.exit, 0) << json.out;
  EXPECT_TRUE(nlohmann::json::accept(json.out));
}

TEST_F(TakeCommand, RepairsATakeThatWasCutOff) {
  cut_off();
  const Ended shown = run("show walk-3.mcap");
  const Ended before = run("verify walk-3.mcap");
  const Ended edit = run("note x walk-3.mcap");

  const Ended repaired = run("repair walk-3.mcap");

  EXPECT_THAT(shown.out, HasSubstr("mocapctl take repair walk-3.mcap"));
  EXPECT_EQ(before.exit, 65);
  EXPECT_THAT(before.out, HasSubstr("the file is cut off"));
  EXPECT_EQ(edit.exit, 65);
  EXPECT_EQ(repaired.exit, 0) << repaired.out;
  EXPECT_EQ(run("verify walk-3.mcap").exit, 0);
}

TEST_F(TakeCommand, DeletesOnlyWithYes) {
  const Ended kept = run("delete walk-3.mcap");
  EXPECT_EQ(kept.exit, 69);
  EXPECT_THAT(kept.out, HasSubstr("add --yes"));
  EXPECT_TRUE(std::filesystem::exists(path()));

  EXPECT_EQ(run("delete walk-3.mcap --yes").exit, 0);
  EXPECT_FALSE(std::filesystem::exists(path()));
  EXPECT_EQ(run("show walk-3.mcap").exit, 66);
}

}  // namespace take_command_test
}  // namespace mocap::ctl
