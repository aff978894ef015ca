#include "bridges/status/status_file.h"

#include <gmock/gmock.h>

#include <fstream>
#include <iterator>

#include "bridges/status/statistics.h"
#include "support/temporary_folder.h"

namespace mocap::bridge {
namespace {

using ::testing::HasSubstr;

std::string content_of(const std::filesystem::path& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST(StatusFile, ReplacesAGivenFileAndKeepsItAtTheEnd) {
  const support::TemporaryFolder folder;
  const auto path = folder.path() / "status.json";
  {
    StatusFile status("mocap-vrpn", path.string());

    status.write("{\"frames\":1}");
    status.write("{\"frames\":2}");
  }

  EXPECT_EQ(content_of(path), "{\"frames\":2}\n");
  EXPECT_NE(std::filesystem::status(path).permissions() & std::filesystem::perms::others_read,
            std::filesystem::perms::none);
}

TEST(StatusFile, StandsInTheFolderOfTheServiceAndIsRemovedAtTheEnd) {
  const support::TemporaryFolder folder;
  ::setenv("RUNTIME_DIRECTORY", folder.path().c_str(), 1);
  const auto path = folder.path() / "status.json";
  {
    StatusFile status("mocap-vrpn", "");

    status.write("{}");

    EXPECT_EQ(content_of(path), "{}\n");
  }
  ::unsetenv("RUNTIME_DIRECTORY");

  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(StatusFile, IsNotWrittenToAFolderThatDoesNotExist) {
  const support::TemporaryFolder folder;
  const auto path = folder.path() / "missing" / "status.json";
  StatusFile status("mocap-vrpn", path.string());

  status.write("{}");

  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(Statistics, AreOneLineOfJsonWithTheReceivers) {
  Statistics counts;
  counts.sent = 7;
  counts.note_added(2000);

  const std::string json =
      to_json("mocap-vrpn", counts, {{"10.0.0.5:3883", "udp"}}, "data arrives", {.lost = 3, .skipped = 4});

  EXPECT_THAT(json, HasSubstr("\"sent\":7"));
  EXPECT_THAT(json, HasSubstr("\"feed_lost\":3"));
  EXPECT_THAT(json, HasSubstr("\"feed_skipped\":4"));
  EXPECT_THAT(json, HasSubstr("\"added_p99_us\":2.0"));
  EXPECT_THAT(json, HasSubstr("\"address\":\"10.0.0.5:3883\""));
}

}  // namespace
}  // namespace mocap::bridge
