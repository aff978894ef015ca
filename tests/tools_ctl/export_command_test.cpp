// mocapctl take export, as a process.
#include <gmock/gmock.h>
#include <sys/wait.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "support/places.h"
#include "support/shell.h"
#include "support/temporary_folder.h"
#include "take/example_take.h"
#include "take/recordings/snapshot_writer.h"

namespace mocap::ctl {
namespace export_command_test {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

struct Ended {
  int exit = -1;
  std::string out;
};

constexpr std::uint64_t kSets = 30;

// A take of 30 sets in two forms: walk.mcap and walk.pb.
class ExportCommand : public ::testing::Test {
 protected:
  void SetUp() override {
    ASSERT_NO_FATAL_FAILURE(take::record_example(folder_.path() / "walk.mcap", kSets));
    auto writer = take::make_snapshot_writer(folder_.path() / "walk.pb", take::example_description());
    ASSERT_TRUE(writer);
    for (std::uint64_t set = 0; set < kSets; ++set) ASSERT_TRUE((*writer)->write(take::example_snapshot(set)));
    ASSERT_TRUE((*writer)->finish());
  }

  Ended run(const std::string& words) const {
    const std::string command = "cd " + support::quoted(folder_.path()) + " && " +
                                support::quoted(support::program_folder() + "/mocapctl") + " take export " + words +
                                " 2>&1 </dev/null";
    Ended ended;
    FILE* pipe = ::popen(command.c_str(), "r");
    std::array<char, 4096> block;
    for (std::size_t count; (count = std::fread(block.data(), 1, block.size(), pipe)) > 0;)
      ended.out.append(block.data(), count);
    ended.exit = WEXITSTATUS(::pclose(pipe));
    return ended;
  }
  bool exists(const std::string& name) const { return fs::exists(folder_.path() / name); }
  std::string content(const std::string& name) const {
    std::ifstream in(folder_.path() / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::size_t files() const {
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_.path()), fs::directory_iterator()));
  }

  support::TemporaryFolder folder_;
};

TEST_F(ExportCommand, WritesEveryFormat) {
  for (const char* name : {"a.c3d", "a.trc", "a.csv", "a.bvh", "a.glb", "a.usda", "a.fbx"}) {
    const Ended ended = run(std::string("walk.mcap --out ") + name);

    EXPECT_EQ(ended.exit, 0) << ended.out;
    EXPECT_GT(content(name).size(), 1000U) << name;
  }
  EXPECT_EQ(files(), 9U) << "a partial file is left";
}

TEST_F(ExportCommand, WritesTheRecordedNumbers) {
  ASSERT_EQ(run("walk.mcap --out a.csv --unit mm").exit, 0);
  ASSERT_EQ(run("walk.pb --out b.csv --unit mm").exit, 0);

  EXPECT_EQ(content("a.csv"), content("b.csv"));
  std::istringstream lines(content("a.csv"));
  std::string line, cell;
  std::getline(lines, line);
  for (std::uint64_t set = 0; set < kSets; ++set) {
    std::getline(lines, line);
    std::istringstream cells(line);
    std::getline(cells, cell, ',');
    EXPECT_EQ(cell, std::to_string(set));
    std::getline(cells, cell, ',');
    const Snapshot truth = take::example_snapshot(set);
    const LabelledMarker& marker = truth.labels[0].markers[0];
    if (marker.state == LabelState::Lost) continue;
    for (int axis = 0; axis < 3; ++axis) {
      std::getline(cells, cell, ',');
      EXPECT_NEAR(std::stod(cell), 1e3 * marker.position.v[axis], 1e-3);
    }
  }
}

TEST_F(ExportCommand, KeepsAnExistingFile) {
  folder_.write("a.c3d", "mine");

  const Ended ended = run("walk.mcap --out a.c3d");

  EXPECT_EQ(ended.exit, 65);
  EXPECT_THAT(ended.out, HasSubstr("the next free name is a-2.c3d"));
  EXPECT_EQ(content("a.c3d"), "mine");
}

TEST_F(ExportCommand, LeavesNoFileAfterAnError) {
  EXPECT_EQ(run("walk.mcap --out a.c3d --subject nobody").exit, 65);
  EXPECT_EQ(run("walk.mcap --out a.c3d --range 10:00:00:00 10:00:01:00").exit, 65);
  EXPECT_EQ(run("walk.mcap --out a.c3d --range 90 100").exit, 65);
  EXPECT_EQ(run("nothing.pb --out a.c3d").exit, 65);
  EXPECT_EQ(files(), 2U);
}

TEST_F(ExportCommand, SelectsFramesAndRate) {
  const Ended ended = run("walk.pb --format trc --fps 60 --range 4f 23f --json");

  ASSERT_EQ(ended.exit, 0) << ended.out;
  const auto json = nlohmann::json::parse(ended.out);
  EXPECT_EQ(json.at("file"), "walk.trc");
  EXPECT_EQ(json.at("frames"), 10);
  EXPECT_EQ(json.at("first_frame"), 2);
  EXPECT_EQ(json.at("rate_hz"), 60.0);
  EXPECT_TRUE(exists("walk.trc"));
}

TEST_F(ExportCommand, RefusesWhatAFormatCannotDo) {
  for (const auto& [words, why] : {std::pair("walk.pb --out a.glb --axes z-up", "gltf files are always y-up"),
                                   {"walk.pb --out a.fbx --unit m", "fbx files are always in cm"},
                                   {"walk.pb --out a.xyz", "expected one of c3d, trc"},
                                   {"walk.pb", "give --format"},
                                   {"walk.pb --out a.csv --fps 0", "expected 1 to 10000"},
                                   {"walk.pb --out a.csv --fill some", "expected none, recorded"},
                                   {"walk.pb --out a.csv --range 1 x", "neither seconds"}}) {
    const Ended ended = run(words);

    EXPECT_EQ(ended.exit, 64) << words;
    EXPECT_THAT(ended.out, HasSubstr(why));
  }
  EXPECT_EQ(files(), 2U);
}

}  // namespace export_command_test
}  // namespace mocap::ctl
