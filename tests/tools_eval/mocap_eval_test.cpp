// Tests of the program mocap-eval with its command line.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "support/places.h"
#include "support/shell.h"
#include "wire/codec/json.h"

namespace mocap::eval {
namespace mocap_eval_test {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

struct Outcome {
  int exit_code;
  std::string out;  ///< standard output, then standard error where it was asked for
};

Outcome run(const std::string& arguments) {
  const std::string command = support::quoted(support::program_folder() + "/mocap-eval") + " " + arguments;
  std::FILE* pipe = ::popen(command.c_str(), "r");
  EXPECT_NE(pipe, nullptr);
  std::string out;
  char piece[4096];
  for (std::size_t n = 0; (n = std::fread(piece, 1, sizeof(piece), pipe)) > 0;) out.append(piece, n);
  const int status = ::pclose(pipe);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, out};
}

class MocapEval : public ::testing::Test {
 protected:
  MocapEval()
      : folder_(fs::temp_directory_path() / (std::string("mocap_eval_") + std::to_string(::getpid()) +
                                             ::testing::UnitTest::GetInstance()->current_test_info()->name())) {
    fs::create_directories(folder_);
  }
  ~MocapEval() override { fs::remove_all(folder_); }

  std::string write(const std::string& name, double off_m) const {
    std::ofstream out(folder_ / name);
    for (int i = 0; i < 200; ++i) {
      Snapshot snapshot;
      snapshot.number = static_cast<std::uint64_t>(i);
      snapshot.instants.exposed_at = from_ns(i * 10'000'000LL);
      SubjectLabels& labels = snapshot.labels.push_back({});
      labels.subject = SubjectId{0};
      LabelledMarker& marker = labels.markers.push_back({});
      marker.state = LabelState::Measured;
      marker.position.v = {0.01 * i, off_m, 1.0};
      out << wire::to_json_line(snapshot) << '\n';
    }
    return (folder_ / name).string();
  }
  std::string write_text(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }

  fs::path folder_;
};

TEST_F(MocapEval, PrintsOneJsonObjectWithAndWithoutTheSubcommand) {
  const std::string files = "--truth " + write("truth", 0.0) + " --stream " + write("stream", 0.001) + " --json";

  for (const std::string& arguments : {files, "score " + files}) {
    const Outcome done = run(arguments);

    EXPECT_EQ(done.exit_code, 0);
    const auto json = nlohmann::json::parse(done.out);
    EXPECT_NEAR(json.at("marker_rms_mm").get<double>(), 1.0, 1e-3);  // positions are single precision
    EXPECT_EQ(json.at("labels_right"), 100);
    EXPECT_EQ(json.at("label_errors"), 0);
  }
}

TEST_F(MocapEval, ExitsWith1IfALimitIsNotMet) {
  const std::string files = "score --truth " + write("truth", 0.0) + " --stream " + write("stream", 0.003);

  EXPECT_EQ(run(files + " --max-label-errors 0 --min-frames 100").exit_code, 0);
  const Outcome done = run(files + " --max-marker-rms-mm 2 2>&1");

  EXPECT_EQ(done.exit_code, 1);
  EXPECT_THAT(done.out, HasSubstr("marker_rms_mm is 3.0"));
  EXPECT_EQ(run(files + " --max-joint-rms-mm 1000 2>&1").exit_code, 1);                // the stream has no joints
  EXPECT_EQ(run(files + " --require-match --max-marker-rms-mm 4 2>&1").exit_code, 1);  // the stream has no joints
}

TEST_F(MocapEval, ScoresLabelsAndBonesOfFilesAndWritesPlots) {
  const std::string files = "--truth " + write("truth", 0.0) + " --stream " + write("stream", 0.001);
  const std::string plots = " --json --plots " + (folder_ / "plots").string();

  const Outcome names = run("labels " + files + plots), bones = run("skeleton " + files + plots);

  EXPECT_EQ(names.exit_code, 0);
  const auto json = nlohmann::json::parse(names.out);
  for (const char* key : {"precision", "recall", "f1"}) EXPECT_EQ(json.at(key), 1.0) << key;
  EXPECT_EQ(json.at("wrong_events"), 0);
  EXPECT_EQ(json.at("longest_wrong_sets"), 0);
  EXPECT_EQ(json.at("availability"), 0.0);  // the stream has labels but no skeleton
  EXPECT_EQ(json.at("first_label_s"), 0.0);
  EXPECT_TRUE(json.at("reacquire_s").is_null());
  EXPECT_EQ(json.at("mota"), 1.0);
  EXPECT_NEAR(json.at("motp_mm").get<double>(), 1.0, 1e-3);
  EXPECT_EQ(bones.exit_code, 0);
  EXPECT_TRUE(nlohmann::json::parse(bones.out).at("joint_rms_mm").is_null());
  EXPECT_TRUE(nlohmann::json::parse(bones.out).contains("jitter_mm"));
  EXPECT_TRUE(fs::exists(folder_ / "plots" / "names_0.svg"));
}

TEST_F(MocapEval, RunsASceneFromAFile) {
  const std::string scene = write_text("scene.toml",
                                       "seconds = 2\n[goal]\nf1 = 0.9\n[[actor]]\nname = 'a'\nmotion = 'tpose'\n"
                                       "marker_set = '" +
                                           support::source_folder() + "/config/markersets/baseline41.toml'\n");

  const Outcome done = run("scene " + scene + " --json --require-goals --plots " + (folder_ / "plots").string());

  EXPECT_EQ(done.exit_code, 0);
  const auto json = nlohmann::json::parse(done.out);
  EXPECT_GT(json.at("f1").get<double>(), 0.9);
  EXPECT_EQ(json.at("goals").at(0).at("met"), true);
  EXPECT_EQ(json.at("clips").at(0).at("subjects").at(0).at("subject"), "a");
  EXPECT_TRUE(fs::exists(folder_ / "plots" / "scene_a_names.svg"));
  EXPECT_TRUE(fs::exists(folder_ / "plots" / "scene_a_joints.svg"));
}

TEST_F(MocapEval, ReportsAMissingMotionAndTheFaultsOfAScene) {
  const std::string actor =
      "[[actor]]\nname = 'a'\nmarker_set = '" + support::source_folder() + "/config/markersets/baseline41.toml'\n";
  const std::string missing = write_text("missing.toml", actor + "motion = 'no_such.bvh'\n");
  const std::string faulty = write_text("faulty.toml", actor + "motion = 'walk'\nsecons = 3\n");

  const Outcome skipped = run("scene " + missing), refused = run("scene " + faulty + " 2>&1");

  EXPECT_EQ(skipped.exit_code, 66);
  EXPECT_THAT(skipped.out, HasSubstr("skipped: motion 'no_such.bvh'"));
  EXPECT_EQ(refused.exit_code, 65);
  EXPECT_THAT(refused.out, HasSubstr("faulty.toml:5:1: actor 'a': unknown key 'secons'"));
}

TEST_F(MocapEval, ReportsTheLineThatCannotBeRead) {
  const std::string truth = write("truth", 0.0);
  const std::string bad = write_text("bad", R"({"instants":{"exposedAtNs":"1"}})"
                                            "\n\nnonsense\n");

  const Outcome done = run("score --truth " + truth + " --stream " + bad + " 2>&1");

  EXPECT_EQ(done.exit_code, 65);
  EXPECT_THAT(done.out, HasSubstr("bad:3: not a snapshot in JSON"));
}

TEST_F(MocapEval, ReadsAStreamWithAnIncompleteLastLine) {
  const std::string truth = write("truth", 0.0);
  const std::string stream = write("stream", 0.0);
  fs::resize_file(stream, fs::file_size(stream) - 20);

  const Outcome done = run("score --truth " + truth + " --stream " + stream + " --json");

  EXPECT_EQ(done.exit_code, 0);
  EXPECT_EQ(nlohmann::json::parse(done.out).at("stream_frames"), 199);
}

TEST_F(MocapEval, ReportsInvalidArguments) {
  EXPECT_EQ(run("2>&1").exit_code, 64);
  EXPECT_EQ(run("nonsense 2>&1").exit_code, 64);
  EXPECT_EQ(run("score 2>&1").exit_code, 64);
  EXPECT_EQ(run("score --truth /no/such --stream /no/such 2>&1").exit_code, 66);
  EXPECT_EQ(run("--help").exit_code, 0);
  EXPECT_EQ(run("score --help").exit_code, 0);
  EXPECT_THAT(run("score --truth " + write_text("empty", "") + " --stream x 2>&1").out, HasSubstr("has no frames"));
}

}  // namespace mocap_eval_test
}  // namespace mocap::eval
