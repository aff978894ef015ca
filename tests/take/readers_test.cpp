// MCAP's own library reads a take: npm's @mcap/core, installed by tools/setup.sh --tests into tests/take/npm.
#include <gmock/gmock.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "support/places.h"
#include "support/shell.h"
#include "support/temporary_folder.h"
#include "take/example_take.h"
#include "take/take_edit.h"

namespace mocap::take {
namespace readers_test {

struct Ended {
  int exit = -1;
  std::string out;
};

Ended run(const std::string& command) {
  Ended ended;
  FILE* pipe = ::popen((command + " 2>&1").c_str(), "r");
  std::array<char, 4096> block;
  for (std::size_t count; (count = std::fread(block.data(), 1, block.size(), pipe)) > 0;)
    ended.out.append(block.data(), count);
  ended.exit = WEXITSTATUS(::pclose(pipe));
  return ended;
}

class TakeReaders : public ::testing::TestWithParam<mcap::Compression> {};

TEST_P(TakeReaders, McapCoreReadsEveryMessageAndFile) {
  const std::filesystem::path npm = std::filesystem::path(support::source_folder()) / "tests/take/npm";
  if (run("node --version").exit != 0) GTEST_SKIP() << "node is not installed; run tools/setup.sh --tests";
  if (!std::filesystem::exists(npm / "node_modules")) GTEST_SKIP() << "no npm packages; run tools/setup.sh --tests";
  const support::TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "take.mcap";
  mcap::WriterSettings settings;
  settings.compression = GetParam();
  ASSERT_NO_FATAL_FAILURE(record_example(path, 50, settings));
  TakeEdit edit;
  edit.notes = "edited";
  ASSERT_TRUE(edit_take(path, edit));

  const Ended ended = run("node " + support::quoted(npm / "read_take.mjs") + " " + support::quoted(path));

  ASSERT_EQ(ended.exit, 0) << ended.out;
  auto json = nlohmann::json::parse(ended.out);
  EXPECT_EQ(json["messages"]["snapshot"], 50);
  EXPECT_EQ(json["messages"]["blobs/camera1"], 50);
  EXPECT_EQ(json["messages"]["description"], 1);
  EXPECT_EQ(json["statistics"]["messages"], 151);
  EXPECT_EQ(json["stream"]["Message"], 151);
  EXPECT_TRUE(json["streamDone"]);
  EXPECT_EQ(json["attachments"][0]["name"], "mocapd.toml");
  EXPECT_EQ(json["attachments"][1]["text"], std::string(3000, 'r'));
  EXPECT_EQ(json["metadata"].back()["notes"], "edited");
  EXPECT_EQ(json["last"]["description"]["cameras"][1]["name"], "camera1");
  EXPECT_EQ(json["last"]["snapshot"]["number"], "49");
  const BlobFrame blobs = example_blobs(1, 49);
  EXPECT_EQ(json["last"]["blobs/camera1"]["x_px"].size(), blobs.blobs.size());
  EXPECT_EQ(json["last"]["blobs/camera1"]["x_px"][3], blobs.blobs[3].centroid.v.x());
}

INSTANTIATE_TEST_SUITE_P(Compressions, TakeReaders,
                         ::testing::Values(mcap::Compression::Zstd, mcap::Compression::Lz4, mcap::Compression::None));

}  // namespace readers_test
}  // namespace mocap::take
