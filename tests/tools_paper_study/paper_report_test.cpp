// Tests of the costs, the runs with four cameras, the tables, the plots, and the program with its command line.
#include "paper_study/report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "paper_study/cv_reference.h"
#include "paper_study/plots.h"
#include "paper_study/published.h"
#include "support/places.h"
#include "support/shell.h"

namespace mocap::paper_study {
namespace paper_report_test {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(CostFigures, AreThePercentilesOfTheTimes) {
  std::vector<double> times_ms;
  for (int i = 100; i >= 0; --i) times_ms.push_back(i);
  const CostFigures cost = cost_of(times_ms);
  EXPECT_EQ(cost.p5_ms, 5.0);
  EXPECT_EQ(cost.median_ms, 50.0);
  EXPECT_EQ(cost.p95_ms, 95.0);
  EXPECT_EQ(cost.max_ms, 100.0);
}

TEST(MeasureCosts, TimesEveryMethodAndTheReferenceWithStableTrackIds) {
  int told = 0;
  const CostSettings settings{{1, 30, 600}, 40};

  const auto costs = measure_costs(settings, [&](int done) { told = done; });

  EXPECT_EQ(told, cost_rows(settings));
  EXPECT_EQ(costs.back().method, "cv_kalman");
  for (const MethodCost& method : costs) {
    ASSERT_EQ(method.rows.size(), 3U);
    for (const CostRow& row : method.rows) {
      EXPECT_GT(row.cost.median_ms, 0.0);
      EXPECT_LE(row.cost.p5_ms, row.cost.median_ms);
      EXPECT_LE(row.cost.p95_ms, row.cost.max_ms);
      // The study's CONDENSATION has errors of tens of pixels and a gate of 60 px, so neighbours 100 px apart exchange
      // their track ids.
      if (method.method != "paper_condensation") {
        EXPECT_TRUE(row.kept_all) << method.method << " " << row.markers;
      }
    }
  }
}

TEST(CvReference, TracksMarkersWithGreedyAssignment) {
  CvReference reference(40.0);
  std::vector<Blob> blobs(2);
  for (int k = 0; k < 20; ++k) {
    blobs[0].centroid.v = {100.0 + 3.0 * k, 100.0};
    blobs[1].centroid.v = {160.0 - 3.0 * k, 130.0};
    if (k % 2 == 1) std::swap(blobs[0], blobs[1]);
    reference.track(blobs);
    if (k % 2 == 1) std::swap(blobs[0], blobs[1]);
    EXPECT_EQ(blobs[0].track.value, 0U);
    EXPECT_EQ(blobs[1].track.value, 1U);
  }
}

TEST(JudgeMultiview, KeepsLabelsBehindABarrierAndAtACrossing) {
  const std::array situations{Situation::Occlusion, Situation::Swapping};
  for (const MultiviewQuality& quality : judge_multiview({3, 77}, situations, [](int) {})) {
    EXPECT_EQ(quality.losses, 0) << name_of(quality.situation);
  }
}

Report small_report() {
  Report report;
  report.settings = {2, 9};
  report.one_camera = judge(report.settings, kStudied, [](int) {});
  return report;
}

TEST(Report, HasAJsonKeyForEachFigure) {
  const auto json = nlohmann::json::parse(to_json(small_report()));
  EXPECT_EQ(json.at("clips"), 2);
  EXPECT_EQ(json.at("losses").at("slow").at("published_alpha_beta"), 3);
  EXPECT_EQ(json.at("losses").at("swapping").at("published_condensation"), 16);
  EXPECT_EQ(json.at("error_px").at("rapid").at("published_kalman").at("samples"), 1080);
  EXPECT_EQ(json.at("error_px").at("rapid").at("published_kalman").at("mean"), 14.98);
  EXPECT_TRUE(json.at("error_px").at("slow").at("published_kalman").at("mean_all").is_null());
  for (const char* key : {"samples", "low", "mean", "high", "mean_all"}) {
    EXPECT_TRUE(json.at("error_px").at("slow").at("paper_kalman").contains(key)) << key;
  }
}

TEST(Report, WritesEveryTableOfTheStudyAsMarkdown) {
  Report report = small_report();
  report.costs = measure_costs({{1, 30}, 5}, [](int) {});
  const std::string text = to_markdown(report);
  for (const char* table :
       {"Table I:", "Table II:", "Table III:", "Table IV:", "Table V:", "Table VI:", "Table VII:"}) {
    EXPECT_THAT(text, HasSubstr(table));
  }
  EXPECT_THAT(text, HasSubstr("| Alpha-Beta, published | 1445 | 6.67 | 7.21 | 7.75 | - |"));
  EXPECT_THAT(text, HasSubstr("| 30 | 1.8860 2.1050 2.7910 2.8120 |"));
  EXPECT_THAT(text, Not(HasSubstr("nan")));
}

TEST(Plot, ShowsThePathsTheBarrierAndTheGates) {
  const Clip clip = make_clip(Situation::Occlusion, 4);
  Followed followed;
  for (std::size_t k = 1; k < clip.frames(); ++k) {
    followed.frames.push_back({clip.ways_px[0][k], 12.5, clip.ways_px[0][k], true});
  }
  const std::string svg = plot(clip, followed, "a title");
  for (const char* part : {"<svg", "class=\"way\"", "class=\"barrier\"", "r=\"12.5\"", "a title", "</svg>"}) {
    EXPECT_THAT(svg, HasSubstr(part));
  }
  EXPECT_THAT(svg, Not(HasSubstr("lost")));
}

struct Outcome {
  int exit_code;
  std::string out;
};

Outcome run(const std::string& arguments) {
  const std::string command = support::quoted(support::program_folder() + "/mocap-eval") + " paper " + arguments;
  std::FILE* pipe = ::popen(command.c_str(), "r");
  EXPECT_NE(pipe, nullptr);
  std::string out;
  char piece[4096];
  for (std::size_t n = 0; (n = std::fread(piece, 1, sizeof(piece), pipe)) > 0;) out.append(piece, n);
  const int status = ::pclose(pipe);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, out};
}

TEST(MocapEvalPaper, PrintsOneJsonObjectWithEveryFigure) {
  const Outcome done = run("--clips 2 --json 2>/dev/null");

  ASSERT_EQ(done.exit_code, 0);
  const auto json = nlohmann::json::parse(done.out);
  for (const char* situation : {"slow", "rapid", "accelerated", "occlusion", "swapping", "passers_by", "two_behind_one",
                                "random_acceleration"}) {
    for (const char* method : {"paper_alpha_beta", "paper_kalman", "paper_condensation", "mocap_alpha_beta",
                               "mocap_adaptive_alpha_beta", "mocap_kalman", "mocap_condensation", "default"}) {
      EXPECT_TRUE(json.at("losses").at(situation).contains(method)) << situation << " " << method;
      EXPECT_TRUE(json.at("error_px").at(situation).contains(method)) << situation << " " << method;
    }
  }
  for (const Situation situation : kStudied) {
    EXPECT_TRUE(json.at("multiview_losses").contains(name_of(situation)));
    EXPECT_TRUE(json.at("losses").at(name_of(situation)).contains("published_kalman"));
  }
  for (const char* method : {"paper_alpha_beta", "mocap_kalman", "default", "cv_kalman"}) {
    for (const char* markers : {"1", "5", "10", "15", "20", "25", "30", "100", "300", "1000"}) {
      for (const char* figure : {"p5", "median", "p95", "max"}) {
        EXPECT_TRUE(json.at("cost_ms").at(method).at(markers).contains(figure)) << method << " " << markers;
      }
    }
  }
}

TEST(MocapEvalPaper, GivesTheSameFiguresForTheSameSeedBaseAndOthersForAnother) {
  const std::string one = run("--clips 3 --no-cost --no-multiview --json 2>/dev/null").out;
  EXPECT_EQ(run("--clips 3 --no-cost --no-multiview --json 2>/dev/null").out, one);
  EXPECT_NE(run("--clips 3 --no-cost --no-multiview --json --seed-base 2 2>/dev/null").out, one);
}

TEST(MocapEvalPaper, WritesPlotsOfTheClipsToAFolder) {
  const fs::path folder = fs::temp_directory_path() / ("mocap_paper_plots_" + std::to_string(::getpid()));
  EXPECT_EQ(run("--clips 1 --no-cost --no-multiview --plots " + folder.string() + " >/dev/null").exit_code, 0);
  EXPECT_TRUE(fs::exists(folder / "swapping_0_default.svg"));
  EXPECT_TRUE(fs::exists(folder / "slow_0_paper_alpha_beta.svg"));
  fs::remove_all(folder);
  EXPECT_EQ(run("--clips 1 --plots /proc/none 2>&1").exit_code, 69);
}

TEST(MocapEvalPaper, ReportsInvalidArgumentsAndShowsExamples) {
  EXPECT_EQ(run("--clips 0 2>&1").exit_code, 64);
  EXPECT_EQ(run("--json --markdown 2>&1").exit_code, 64);
  EXPECT_EQ(run("--nonsense 2>&1").exit_code, 64);
  const Outcome help = run("--help");
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_THAT(help.out, HasSubstr("examples:"));
  EXPECT_THAT(help.out, HasSubstr("--seed-base"));
}

}  // namespace paper_report_test
}  // namespace mocap::paper_study
