// mocap-eval as people run it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "wire/json.h"

namespace mocap::eval {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

struct Outcome {
  int exit_code;
  std::string out;  ///< standard output, then standard error where it was asked for
};

Outcome run(const std::string& arguments) {
  const std::string command = std::string(MOCAP_BIN_DIR) + "/mocap-eval " + arguments;
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

TEST_F(MocapEval, ExitsWith1WhenADemandIsNotMet) {
  const std::string files = "score --truth " + write("truth", 0.0) + " --stream " + write("stream", 0.003);

  EXPECT_EQ(run(files + " --max-label-errors 0 --min-frames 100").exit_code, 0);
  const Outcome done = run(files + " --max-marker-rms-mm 2 2>&1");

  EXPECT_EQ(done.exit_code, 1);
  EXPECT_THAT(done.out, HasSubstr("marker_rms_mm is 3.0"));
  EXPECT_EQ(run(files + " --max-joint-rms-mm 1000 2>&1").exit_code, 1);                // no joints at all
  EXPECT_EQ(run(files + " --require-match --max-marker-rms-mm 4 2>&1").exit_code, 1);  // the same
}

TEST_F(MocapEval, NamesTheLineThatCannotBeRead) {
  const std::string truth = write("truth", 0.0);
  const std::string bad = write_text("bad", R"({"instants":{"exposedAtNs":"1"}})"
                                            "\n\nnonsense\n");

  const Outcome done = run("score --truth " + truth + " --stream " + bad + " 2>&1");

  EXPECT_EQ(done.exit_code, 65);
  EXPECT_THAT(done.out, HasSubstr("bad:3: not a snapshot in JSON"));
}

TEST_F(MocapEval, ReadsAStreamWhoseWriterWasStoppedInTheMiddle) {
  const std::string truth = write("truth", 0.0);
  const std::string stream = write("stream", 0.0);
  fs::resize_file(stream, fs::file_size(stream) - 20);

  const Outcome done = run("score --truth " + truth + " --stream " + stream + " --json");

  EXPECT_EQ(done.exit_code, 0);
  EXPECT_EQ(nlohmann::json::parse(done.out).at("stream_frames"), 199);
}

TEST_F(MocapEval, SaysWhatIsWrongWithItsArguments) {
  EXPECT_EQ(run("2>&1").exit_code, 64);
  EXPECT_EQ(run("nonsense 2>&1").exit_code, 64);
  EXPECT_EQ(run("score 2>&1").exit_code, 64);
  EXPECT_EQ(run("score --truth /no/such --stream /no/such 2>&1").exit_code, 66);
  EXPECT_EQ(run("--help").exit_code, 0);
  EXPECT_EQ(run("score --help").exit_code, 0);
  EXPECT_THAT(run("score --truth " + write_text("empty", "") + " --stream x 2>&1").out, HasSubstr("has no frames"));
}

}  // namespace
}  // namespace mocap::eval
