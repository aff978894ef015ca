#include "lib/farm/submission.h"

#include <gmock/gmock.h>

#include <fstream>
#include <sstream>

#include "support/shell.h"
#include "support/temporary_folder.h"

namespace mocap::farm {
namespace submission_test {

using ::testing::Contains;
using ::testing::HasSubstr;

std::string text_of(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

class Submissions : public testing::Test {
 protected:
  Submissions() {
    order_.common = {folder_.write("mocapctl", "#!/bin/sh\necho \"$@\"\n"), {"--resume"}};
    std::filesystem::permissions(order_.common.mocapctl, std::filesystem::perms::owner_all);
    order_.folder = folder_.path() / "it's 100 % new" / "farm";
    for (const char* name : {"a", "b c", "d'e"}) {
      const auto take = folder_.write(std::string(name) + ".mcap", "bytes");
      order_.units.push_back({take, folder_.path() / "new" / take.filename(), 5});
    }
  }

  // Runs "unit.sh N" of a submission; returns its exit code.
  std::string run_unit(const std::string& number) const {
    return support::output_of("bash " + shell_word((order_.folder / "unit.sh").string()) + " " + number +
                              " >/dev/null 2>&1; printf %s $?");
  }

  // How often the program was run.
  static std::string runs_in(const std::filesystem::path& log) {
    return support::output_of("grep -cx run " + shell_word(log.string()));
  }

  std::string joblog(const FarmOrder& order) const {
    const auto submission = write_parallel(order);
    EXPECT_TRUE(submission) << submission.error().message;
    const auto& words = submission->command;
    return *std::next(std::ranges::find(words, "--joblog"));
  }

  support::TemporaryFolder folder_;
  FarmOrder order_;
};

TEST(ShellWord, KeepsEveryCharacter) {
  const std::string text = "it's a \"$HOME\" `word` \\ * ; %";

  EXPECT_EQ(support::output_of("printf %s " + shell_word(text)), text);
  EXPECT_EQ(support::output_of("printf '<%s>' " + shell_words({"a b", "", "c'd"})), "<a b><><c'd>");
}

TEST_F(Submissions, TheScriptOfTheUnitsRunsOneAndKeepsItsOutputAndExitCode) {
  ASSERT_TRUE(write_slurm(order_));

  EXPECT_EQ(run_unit("2"), "0");

  EXPECT_THAT(text_of(log_of(order_, 2)), HasSubstr("take retrack " + order_.units[2].take.string() + " --out"));
  EXPECT_EQ(exit_code_of(order_, 2), 0);
  EXPECT_FALSE(std::filesystem::exists(log_of(order_, 0)));
  EXPECT_EQ(run_unit("7"), "64");
}

TEST_F(Submissions, AUnitThatASignalEndedIsRunOnceMore) {
  folder_.write("mocapctl", "#!/bin/sh\necho run\nkill -9 $$\n");
  ASSERT_TRUE(write_slurm(order_));
  EXPECT_EQ(run_unit("0"), "137");
  EXPECT_EQ(runs_in(log_of(order_, 0)), "2\n");

  folder_.write("mocapctl", "#!/bin/sh\necho run\nkill -15 $$\n");
  EXPECT_EQ(run_unit("0"), "143");
  EXPECT_EQ(runs_in(log_of(order_, 0)), "1\n") << "the job was cancelled";
}

TEST_F(Submissions, SlurmHasOneElementForEachUnit) {
  order_.jobs = 2;

  const auto submission = write_slurm(order_);

  ASSERT_TRUE(submission) << submission.error().message;
  ASSERT_EQ(submission->files.size(), 2U);
  EXPECT_THAT(text_of(submission->files[0]), HasSubstr("#SBATCH --array=0-2%2\n"));
  EXPECT_EQ(submission->command.front(), "sbatch");
  EXPECT_THAT(submission->command, Contains(HasSubstr("it's 100 %% new/farm/slurm-%a.log")));
}

TEST_F(Submissions, GnuParallelGoesOnWithTheLogOfTheSameWork) {
  const std::string log = joblog(order_);
  std::ofstream(log) << "done\n";
  order_.resume = true;

  EXPECT_EQ(joblog(order_), log);
  EXPECT_TRUE(std::filesystem::exists(log));
  std::ofstream(exit_file_of(order_, 1)) << "0\n";
  EXPECT_EQ(joblog(order_), log);
  EXPECT_FALSE(std::filesystem::exists(log)) << "the new take of a job that ended is missing";
  folder_.write("b c.mcap", "other bytes");
  EXPECT_NE(joblog(order_), log) << "a take has changed";
}

TEST_F(Submissions, GnuParallelForgetsAnEarlierRunWithoutResume) {
  const std::string log = joblog(order_);
  std::ofstream(log) << "done\n";

  EXPECT_EQ(joblog(order_), log);
  EXPECT_FALSE(std::filesystem::exists(log));
}

}  // namespace submission_test
}  // namespace mocap::farm
