#include "web/import_process.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <string>

#include "support/temporary_folder.h"

namespace mocap::web {
namespace import_process_test {

using testing::ElementsAre;
using testing::HasSubstr;
using namespace std::chrono_literals;

// A script in the place of mocapctl: $3 is the file, $4 the name, $5 the folder.
Result<ImportedSubject> import_with(const std::string& script, bool at_rest = false,
                                    std::chrono::nanoseconds patience = 60s, bool stopped = false) {
  const support::TemporaryFolder folder;
  const auto path = folder.write("mocapctl", "#!/bin/sh\nout=${5#--out=}; mkdir $out\n" + script);
  std::filesystem::permissions(path, std::filesystem::perms::owner_all);
  const std::atomic<bool> stop = stopped;
  return run_import(path, {"anna", at_rest, "bytes"}, patience, stop);
}

TEST(ImportProcess, BringsReportWarningsAndMarkerSet) {
  const auto imported = import_with(
      "cp $3 $out/anna.markers.toml; echo 'skeleton = \"../../x/human18.toml\"  # relative' >> $out/anna.markers.toml;"
      "echo 'marker = []' >> $out/anna.markers.toml; echo \"mocapctl: label 'X' is unknown\" >&2; echo \"$@\"",
      true);

  ASSERT_TRUE(imported) << imported.error().message;
  EXPECT_THAT(
      imported->report_json,
      testing::MatchesRegex(
          "subject import .*/upload.c3d --name=anna --out=.*/out --json --skeleton=skeletons/human18.toml --static\n"));
  EXPECT_THAT(imported->warnings, ElementsAre("label 'X' is unknown"));
  EXPECT_EQ(imported->marker_set, "bytesskeleton = \"../../x/human18.toml\"  # relative\nmarker = []\n")
      << "no line of its own: left as it is";
}

TEST(ImportProcess, NamesTheShippedSkeleton) {
  const auto imported =
      import_with("printf 'name = \"anna\"\\nskeleton = \"../../x.toml\"\\nmarker = []\\n' > $out/anna.markers.toml");

  ASSERT_TRUE(imported) << imported.error().message;
  EXPECT_EQ(imported->marker_set,
            "name = \"anna\"\nskeleton = \"../skeletons/human18.toml\"  # of the shipped ones\nmarker = []\n");
}

TEST(ImportProcess, FailsWithTheSentencesOfTheCommandButNotItsFolder) {
  const auto imported =
      import_with("echo mocapctl: label \"'X'\" is unknown >&2; echo \"mocapctl: $3: no C3D file\" >&2; exit 65");

  ASSERT_FALSE(imported);
  EXPECT_EQ(imported.error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(imported.error().message, "label 'X' is unknown\nupload.c3d: no C3D file");
}

TEST(ImportProcess, EndsACommandThatTakesTooLong) {
  const auto imported = import_with("exec sleep 1000", false, 1ms);

  ASSERT_FALSE(imported);
  EXPECT_EQ(imported.error().code, ErrorCode::Io);
  EXPECT_THAT(imported.error().message, HasSubstr("use a shorter file"));
}

TEST(ImportProcess, EndsWhenItIsStopped) {
  const auto imported = import_with("exec sleep 1000", false, 1h, true);

  ASSERT_FALSE(imported);
  EXPECT_EQ(imported.error().code, ErrorCode::Io);
}

TEST(ImportProcess, HasNoFileOfThisProgram) {
  // As a socket of the server: a descriptor that a new program would have, too.
  const int connection = ::fcntl(STDERR_FILENO, F_DUPFD, 500);

  const auto imported =
      import_with("test -e /proc/$$/fd/" + std::to_string(connection) + " && echo 'it has the connection'");

  ::close(connection);
  ASSERT_FALSE(imported) << imported->report_json;
}

TEST(ImportProcess, FailsWithoutTheCommand) {
  const auto imported = run_import("/nowhere/mocapctl", {"anna", false, "x"}, 60s, false);
  EXPECT_THAT(imported.error().message, HasSubstr("/nowhere/mocapctl cannot be started"));
}

}  // namespace import_process_test
}  // namespace mocap::web
