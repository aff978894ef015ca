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
#include <vector>

#include "export/spec_c3d.h"
#include "support/places.h"
#include "support/shell.h"
#include "support/temporary_folder.h"
#include "take/example_take.h"
#include "take/recordings/snapshot_writer.h"
#include "take/take_writer.h"

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

  // A take with these marks, all at set 4.
  void record_marks(const std::string& name, const std::vector<std::string>& texts) const {
    auto writer = take::TakeWriter::create(folder_.path() / name, take::example_start());
    ASSERT_TRUE(writer);
    ASSERT_TRUE(take::append_example(**writer, 0, kSets));
    for (const std::string& text : texts) {
      v1::Event mark;
      mark.set_kind(v1::EVENT_KIND_MARK);
      mark.set_message(text);
      ASSERT_TRUE((*writer)->append(take::kEventTopic, take::example_time(4), mark.SerializeAsString()));
    }
    ASSERT_TRUE((*writer)->finish(take::example_end(kSets)));
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

TEST_F(ExportCommand, EndsWith65IfTheTakeCannotBeRead) {
  fs::create_directory(folder_.path() / "folder.mcap");  // which root cannot read either

  const Ended ended = run("folder.mcap --out a.c3d");

  EXPECT_EQ(ended.exit, 65);
  EXPECT_THAT(ended.out, HasSubstr("is not a regular file"));
}

TEST_F(ExportCommand, LeavesNoFileAfterAnError) {
  EXPECT_EQ(run("walk.mcap --out a.c3d --subject nobody").exit, 65);
  EXPECT_EQ(run("walk.mcap --out a.c3d --range 10:00:00:00 10:00:01:00").exit, 65);
  EXPECT_EQ(run("walk.mcap --out a.c3d --range 90 100").exit, 65);
  EXPECT_EQ(run("nothing.pb --out a.c3d").exit, 66);
  EXPECT_EQ(run("walk.mcap --out nowhere/a.c3d").exit, 73);
  EXPECT_EQ(files(), 2U);
}

TEST_F(ExportCommand, WritesTheMarksOfTheOperatorIntoC3d) {
  record_marks("marked.mcap", {"jump"});

  const Ended c3d = run("marked.mcap --out a.c3d --json"), csv = run("marked.mcap --out a.csv");

  ASSERT_EQ(c3d.exit, 0) << c3d.out;
  EXPECT_EQ(nlohmann::json::parse(c3d.out).at("marks"), 1);
  const exports::testing::SpecC3d file(content("a.c3d"));
  EXPECT_EQ(file["EVENT:USED"].integer(), 1);
  EXPECT_EQ(file["EVENT:LABELS"].text(0), "jump");
  EXPECT_FLOAT_EQ(file["EVENT:TIMES"].real(1), 4.0F / 120.0F);
  EXPECT_THAT(csv.out, HasSubstr("1 of 1 marks were left out: a csv file holds 0"));
}

TEST_F(ExportCommand, KeepsAsManyMarksAsTheFormatHolds) {
  record_marks("marked.mcap", std::vector<std::string>(300, "again"));

  const Ended ended = run("marked.mcap --out a.c3d");

  ASSERT_EQ(ended.exit, 0) << ended.out;
  EXPECT_THAT(ended.out, HasSubstr("45 of 300 marks were left out: a c3d file holds 255"));
  EXPECT_EQ(exports::testing::SpecC3d(content("a.c3d"))["EVENT:USED"].integer(), 255);
}

TEST_F(ExportCommand, TellsWhatIsMissingOfACutOffTake) {
  const fs::path take = folder_.path() / "walk.mcap";
  fs::resize_file(take, fs::file_size(take) / 2);

  const Ended text = run("walk.mcap --out a.csv"), json = run("walk.mcap --out b.csv --json");

  EXPECT_THAT(text.out, HasSubstr("the take was cut off"));
  ASSERT_EQ(json.exit, 0) << json.out;
  EXPECT_EQ(nlohmann::json::parse(json.out).at("cut_off"), true);
}

TEST_F(ExportCommand, TellsThatASubjectWasNeverTracked) {
  auto writer = take::make_snapshot_writer(folder_.path() / "still.pb", take::example_description());
  ASSERT_TRUE(writer);
  for (std::uint64_t set = 0; set < kSets; ++set) {
    Snapshot snapshot = take::example_snapshot(set);
    snapshot.poses.clear();
    ASSERT_TRUE((*writer)->write(snapshot));
  }
  ASSERT_TRUE((*writer)->finish());

  const Ended ended = run("still.pb --out a.csv");

  ASSERT_EQ(ended.exit, 0) << ended.out;
  const std::string name = take::example_description().subjects[0].name;
  EXPECT_THAT(ended.out, HasSubstr(name + " has a pose in 0 of 30 frames"));
}

TEST_F(ExportCommand, RefusesAMisspeltSubjectAlsoBesideARightOne) {
  const std::string name = take::example_description().subjects[0].name;

  const Ended right = run("--subject '" + name + "' walk.mcap --format csv");
  const Ended misspelt = run("walk.mcap --out a.csv --subject '" + name + "' --subject misspelt");

  EXPECT_EQ(right.exit, 0) << right.out;
  EXPECT_EQ(misspelt.exit, 65);
  EXPECT_THAT(misspelt.out, HasSubstr("no subject 'misspelt'; its subjects are '" + name + "'"));
}

TEST_F(ExportCommand, WritesIntoAFolderAndKnowsExtensionsInCapitals) {
  fs::create_directory(folder_.path() / "out");

  const Ended folder = run("walk.mcap --format csv --out out"), capitals = run("walk.mcap --out A.C3D");

  EXPECT_EQ(folder.exit, 0) << folder.out;
  EXPECT_TRUE(exists("out/walk.csv"));
  EXPECT_EQ(capitals.exit, 0) << capitals.out;
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
                                   {"walk.pb --out a.xyz", "--out is 'a.xyz'"},
                                   {"walk.pb --out a.xyz", "expected to be one of c3d, trc, csv, bvh, glb"},
                                   {"walk.pb --out a.gltf", "expected a.glb"},
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
