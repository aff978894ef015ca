#include "web/takes/export_process.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <string>

#include "support/temporary_folder.h"

namespace mocap::web {
namespace export_process_test {

using testing::HasSubstr;

// A script in the place of mocapctl.
std::filesystem::path program(const support::TemporaryFolder& folder, const std::string& script) {
  const auto path = folder.write("mocapctl", "#!/bin/sh\n" + script);
  std::filesystem::permissions(path, std::filesystem::perms::owner_all);
  return path;
}

struct Ran {
  Result<std::shared_ptr<OpenFile>> file;
  double progress = 0.0;
};

Ran run(const std::filesystem::path& mocapctl, bool stopped = false) {
  std::atomic<double> progress = 0.0;
  const std::atomic<bool> stop = stopped;
  auto file = run_export(mocapctl, {"/takes/walk.mcap", "csv", {"--unit=mm"}}, progress, stop);
  return {std::move(file), progress};
}

TEST(ExportProcess, BringsTheFileOfTheCommand) {
  const support::TemporaryFolder folder;

  const Ran ran = run(program(folder, "echo progress 0.5 >&2; echo \"$@\" > $5"));

  ASSERT_TRUE(ran.file) << ran.file.error().message;
  EXPECT_THAT((*ran.file)->read(0, 1000), testing::MatchesRegex("take export /takes/walk.mcap --out .*/export "
                                                                "--format=csv --progress --unit=mm\n"));
  EXPECT_EQ(ran.progress, 0.5);
}

TEST(ExportProcess, FailsWithTheSentenceOfTheCommand) {
  const support::TemporaryFolder folder;

  const Ran ran = run(program(folder, "echo progress 0.5 >&2; echo mocapctl: the take is empty >&2; exit 65"));

  ASSERT_FALSE(ran.file);
  EXPECT_EQ(ran.file.error().message, "the take is empty");
}

TEST(ExportProcess, FailsWithoutTheCommand) {
  EXPECT_THAT(run("/nowhere/mocapctl").file.error().message, HasSubstr("/nowhere/mocapctl cannot be started"));
}

TEST(ExportProcess, EndsWhenItIsStopped) {
  const support::TemporaryFolder folder;

  const Ran ran = run(program(folder, "exec sleep 1000"), true);

  ASSERT_FALSE(ran.file);
  EXPECT_THAT(ran.file.error().message, HasSubstr("signal 9"));
}

TEST(ExportProcess, HasNoFileOfThisProgram) {
  const support::TemporaryFolder folder;
  // As a socket of the server: a descriptor that a new program would have, too.
  const int connection = ::fcntl(STDERR_FILENO, F_DUPFD, 500);

  const Ran ran = run(program(
      folder, "test -e /proc/$$/fd/" + std::to_string(connection) + " && echo has the connection >&2; exit 65"));

  ::close(connection);
  ASSERT_FALSE(ran.file);
  EXPECT_EQ(ran.file.error().message, "");
}

TEST(ExportProcess, IsBesideThisProgram) { EXPECT_EQ(mocapctl_here().filename(), "mocapctl"); }

}  // namespace export_process_test
}  // namespace mocap::web
