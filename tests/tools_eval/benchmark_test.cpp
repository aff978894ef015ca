#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "eval/benchmark_report.h"
#include "eval/command.h"
#include "support/places.h"
#include "support/temporary_folder.h"

namespace mocap::eval {
namespace benchmark_test {

using ::testing::HasSubstr;
using ::testing::Not;

BenchmarkCase case_of(const std::string& take) {
  BenchmarkCase one{take, benchmark::BodyKnown::Given, "soma", 3, {"LASI", "RASI"}, {}};
  one.run.figures.macro_f1 = 0.98765;
  one.run.figures.longest_wrong_frames = 7;
  one.run.offline.macro_f1 = 0.99876;
  one.run.withheld[static_cast<std::size_t>(benchmark::Withheld::OutsideGate)] = 5;
  one.run.withheld_of.resize(2);
  one.run.withheld_of[1][static_cast<std::size_t>(benchmark::Withheld::OutsideGate)] = 5;
  one.run.confusions = {{0, -1, 9}, {1, 0, 2}};
  return one;
}

// Runs the command with these arguments and returns its exit code and standard output.
std::pair<int, std::string> run_command(std::vector<std::string> arguments) {
  std::vector<const char*> argv{"benchmark"};
  for (const std::string& argument : arguments) argv.push_back(argument.c_str());
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  const int code = run_benchmark(static_cast<int>(argv.size()), argv.data());
  std::string out = testing::internal::GetCapturedStdout();
  return {code, out + testing::internal::GetCapturedStderr()};
}

TEST(BenchmarkReport, LineAndHeaderHaveTheSameColumns) {
  const std::string header = benchmark_header(), line = benchmark_line(case_of("walk"));

  EXPECT_EQ(header.size(), line.size());
  EXPECT_THAT(line, HasSubstr("walk"));
  EXPECT_THAT(line, HasSubstr("0.9877"));
  EXPECT_THAT(line, HasSubstr("      7"));
  EXPECT_THAT(header, HasSubstr("off. F1"));
  EXPECT_THAT(line, HasSubstr("0.9988"));
}

TEST(BenchmarkReport, ReasonsNameMarkersAndWrongLabels) {
  const std::string text = benchmark_reasons({case_of("walk"), case_of("walk")});

  EXPECT_THAT(text, HasSubstr("walk, given: 10 points"));
  EXPECT_THAT(text, HasSubstr("outside the gate"));
  EXPECT_THAT(text, HasSubstr("RASI"));
  EXPECT_THAT(text, HasSubstr("LASI on no marker in 9 frames"));
  EXPECT_THAT(text, HasSubstr("RASI on LASI in 2 frames"));
}

TEST(BenchmarkReport, JsonHasNullForAbsentFigures) {
  const auto json = nlohmann::json::parse(benchmark_json({case_of("walk")}));

  EXPECT_NEAR(json["runs"][0]["macro_f1"].get<double>(), 0.98765, 1e-12);
  EXPECT_TRUE(json["runs"][0]["idf1"].is_null());
  EXPECT_NEAR(json["runs"][0]["offline"]["macro_f1"].get<double>(), 0.99876, 1e-12);
  EXPECT_EQ(json["runs"][0]["withheld"]["outside the gate"], 5);
}

TEST(BenchmarkReport, SvgIsSafeForAnyName) {
  const support::TemporaryFolder folder;

  ASSERT_TRUE(write_benchmark_svg(folder.path() / "labels.svg", {case_of("a<b&c")}));
  EXPECT_FALSE(write_benchmark_svg(folder.path() / "none/labels.svg", {}));

  std::ifstream file(folder.path() / "labels.svg");
  const std::string text(std::istreambuf_iterator<char>(file), {});
  EXPECT_THAT(text, HasSubstr("a&lt;b&amp;c, given, soma"));
  EXPECT_THAT(text, Not(HasSubstr("a<b")));
  EXPECT_THAT(text, HasSubstr("0.9877"));
}

TEST(BenchmarkCommand, RefusesUnknownWordsAndMissingFiles) {
  EXPECT_THAT(run_command({"labels", "none.c3d"}).second, HasSubstr("none.c3d"));
  EXPECT_NE(run_command({"labels", "none.c3d"}).first, 0);
  EXPECT_THAT(run_command({"labels", "none.c3d", "--noise", "rain"}).second, HasSubstr("'rain', expected none, soma"));
  EXPECT_THAT(run_command({"labels", "none.c3d", "--modes", "warm"}).second, HasSubstr("'warm', expected given"));
  EXPECT_THAT(run_command({"labels", "none.c3d", "--modes", "static"}).second, HasSubstr("--static FILE"));
}

TEST(BenchmarkCommand, ScoresASkeleton) {
  const auto [code, out] =
      run_command({"skeleton", "wave", "--modes", "given", "--noise", "none", "--seconds", "2", "--json"});

  ASSERT_EQ(code, 0) << out;
  const auto run = nlohmann::json::parse(out)["runs"][0];
  EXPECT_EQ(run["clip"], "wave");
  EXPECT_EQ(run["mode"], "given");
  EXPECT_LT(run["joint_cm"].get<double>(), 0.1);
  EXPECT_TRUE(run["bones"].contains("Hips"));
}

TEST(BenchmarkCommand, RefusesUnknownWordsOfASkeleton) {
  EXPECT_THAT(run_command({"skeleton", "wave", "--modes", "warm"}).second,
              HasSubstr("--modes: 'warm', expected given"));
  EXPECT_THAT(run_command({"skeleton", "wave", "--noise", "rain"}).second, HasSubstr("--noise: 'rain', expected none"));
  EXPECT_THAT(run_command({"skeleton", "none.bvh"}).second, HasSubstr("none.bvh"));
}

TEST(BenchmarkCommand, LabelsARecording) {
  const std::string take = support::shared_data_folder() + "/c3d/btk_pig_walk_fullbody_100.c3d";
  if (!std::filesystem::exists(take)) GTEST_SKIP() << "the recordings are missing: " << take;

  const auto [code, out] = run_command({"labels", take, "--noise", "none", "--modes", "given", "--json"});

  ASSERT_EQ(code, 0) << out;
  const auto json = nlohmann::json::parse(out);
  EXPECT_EQ(json["runs"][0]["wrong_labels"], 0);
  EXPECT_GT(json["runs"][0]["macro_f1_since_first_label"].get<double>(), 0.99);
}

}  // namespace benchmark_test
}  // namespace mocap::eval
