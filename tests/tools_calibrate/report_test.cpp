#include "calibrate/report_rig.h"

#include <gmock/gmock.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "calibration/wand/solve_wand.h"
#include "lib/simworld/wand_world.h"
#include "support/temporary_folder.h"

namespace mocap::calibrate {
namespace report_test {

using ::testing::HasSubstr;

struct Solved {
  Rig truth;
  calibration::RigEvidence evidence;
  calibration::RigAssessment assessment;
};

const Solved& solved() {
  static const Solved solved = [] {
    const calibration::Wand wand{{0.0, 0.16, 0.5}};
    simworld::WandWorld world({.cameras = 5, .noise_px = 0.1, .seconds = 20.0, .rate_hz = 30.0}, wand, 11);
    const auto solution = calibration::solve_wand(world.take(), world.truth(), wand, {});
    Solved made{world.truth(), calibration::evidence_of(*solution, std::nullopt), {}};
    made.assessment = calibration::assess_rig(made.evidence);
    return made;
  }();
  return solved;
}

RigReport report() { return {"north hall <2>", solved().evidence, solved().assessment}; }

TEST(Report, TheJsonHasTheDocumentedKeys) {
  RigReport report_to_truth = report();
  report_to_truth.to_truth =
      *calibration::compare_rigs(solved().truth, solved().evidence.rig, calibration::RigAlignment::AllCameras);

  const auto json = nlohmann::json::parse(report_json(report_to_truth));

  ASSERT_EQ(json["cameras"].size(), 5u);
  for (const auto& [name, camera] : json["cameras"].items()) {
    EXPECT_NEAR(camera["rms_px"].get<double>(), 0.1, 0.02) << name;  // the noise
    EXPECT_NEAR(camera["heldout_px"].get<double>(), 0.1, 0.03) << name;
    EXPECT_GT(camera["points"].get<int>(), 100) << name;
    EXPECT_GT(camera["coverage"].get<double>(), 0.1) << name;
  }
  EXPECT_NEAR(json["wand"]["mean_mm"].get<double>(), 500.0, 0.5);
  EXPECT_LT(json["wand"]["min_mm"].get<double>(), json["wand"]["mean_mm"].get<double>());
  EXPECT_GT(json["wand"]["max_mm"].get<double>(), json["wand"]["mean_mm"].get<double>());
  EXPECT_GT(json["wand"]["std_mm"].get<double>(), 0.0);
  EXPECT_LT(std::abs(json["wand"]["mismatch"].get<double>()), 1e-3);
  EXPECT_FALSE(json.contains("scale_error")) << "the wand is no evidence of the scale";
  EXPECT_TRUE(json["floor"].is_null());  // not measured
  EXPECT_THAT(json["grade"].get<std::string>(), ::testing::AnyOf("excellent", "good"));
  EXPECT_LT(json["position_error_mm"].get<double>(), 1.0);
  EXPECT_LT(json["rotation_error_deg"].get<double>(), 0.02);
}

TEST(Report, ThePageShowsEachCameraAndEscapesNames) {
  const std::string svg = report_svg(report());

  EXPECT_THAT(svg, HasSubstr("north hall &lt;2&gt;"));
  for (const auto& camera : solved().evidence.rig) EXPECT_THAT(svg, HasSubstr(">" + camera.name + "<"));
  EXPECT_THAT(svg, HasSubstr("Wand length"));
  EXPECT_THAT(svg, HasSubstr("Uncertainty of a marker position"));
  EXPECT_THAT(svg, ::testing::Not(HasSubstr("nan")));
  EXPECT_THAT(svg, ::testing::Not(HasSubstr("inf")));
}

TEST(Report, UnknownFiguresAreNoZeros) {
  calibration::RigEvidence evidence = solved().evidence;
  evidence.covariance.resize(0, 0);
  std::erase_if(evidence.residuals, [](const auto& residual) { return residual.held_out; });
  const calibration::RigAssessment assessment = calibration::assess_rig(evidence);
  const RigReport unknown{"hall", evidence, assessment};

  const auto json = nlohmann::json::parse(report_json(unknown));

  EXPECT_EQ(json["grade"], "poor");
  EXPECT_TRUE(json["heldout_px"].is_null());
  for (const auto& camera : json["cameras"]) EXPECT_TRUE(camera["position_sigma_mm"].is_null());
  EXPECT_THAT(report_text(unknown), ::testing::ContainsRegex("cam1 .* % +- +-\n"));
  EXPECT_THAT(report_text(unknown), HasSubstr("scale   from the wand's length, not checked"));
  EXPECT_THAT(report_svg(unknown), HasSubstr("position and rotation not determined"));
}

TEST(Report, TheSuffixOfTheFileDecidesTheFormat) {
  const support::TemporaryFolder folder;
  const auto text_of = [&](const char* name) {
    EXPECT_TRUE(write_report(folder.path() / name, report()));
    std::ifstream in(folder.path() / name);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  EXPECT_THAT(text_of("report.svg"), ::testing::StartsWith("<svg"));
  EXPECT_THAT(text_of("report.json"), ::testing::StartsWith("{"));
  EXPECT_THAT(text_of("report.txt"), ::testing::StartsWith("north hall"));
  // Set MOCAP_KEEP_REPORT to a path to look at the report.
  const char* kept = std::getenv("MOCAP_KEEP_REPORT");
  if (kept != nullptr) {
    EXPECT_TRUE(write_report(kept, report()));
  }
}

}  // namespace report_test
}  // namespace mocap::calibrate
