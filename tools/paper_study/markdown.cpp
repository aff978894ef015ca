// Writes tables I to VII of the study with the published, rebuilt and our figures.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>

#include "paper_study/published.h"
#include "paper_study/report.h"

namespace mocap::paper_study {
namespace {

constexpr std::array kNames{"Alpha-Beta", "Kalman", "CONDENSATION"};
constexpr double kClipsOfTheStudy = 20.0;

const MethodQuality* find(const SituationQuality& quality, const std::string& method) {
  const auto found = std::ranges::find(quality.methods, method, &MethodQuality::method);
  return found == quality.methods.end() ? nullptr : &*found;
}

const SituationQuality* find(const Report& report, Situation situation) {
  const auto found = std::ranges::find(report.one_camera, situation, &SituationQuality::situation);
  return found == report.one_camera.end() ? nullptr : &*found;
}

std::string losses_of(const SituationQuality& quality, const std::string& method) {
  const MethodQuality* figures = find(quality, method);
  return figures == nullptr ? "-" : std::to_string(figures->losses);
}

void add_losses(std::string& text, const Report& report) {
  auto out = std::back_inserter(text);
  fmt::format_to(
      out,
      "## Table I: losses of {} clips\n\n"
      "Each cell: published / the study's code on such clips, of 20 / rebuilt (`paper`) / ours (`mocap`).\n\n"
      "| | Alpha-Beta | Kalman | CONDENSATION | adaptive Alpha-Beta | default | default, {} cameras |\n"
      "|---|---|---|---|---|---|---|\n",
      report.settings.clips, kMultiviewCameras);
  for (const SituationQuality& quality : report.one_camera) {
    fmt::format_to(out, "| {} |", name_of(quality.situation));
    for (std::size_t m = 0; m < kStudyMethods.size(); ++m) {
      const auto published = published_losses(quality.situation, m);
      const auto original = original_code(quality.situation, m);
      fmt::format_to(out, " {} / {} / {} / {} |", published ? std::to_string(*published) : "-",
                     original ? fmt::format("{} ± {}", original->losses, original->deviation) : "-",
                     losses_of(quality, std::string("paper_") + kStudyMethods[m]),
                     losses_of(quality, std::string("mocap_") + kStudyMethods[m]));
    }
    const auto seen = std::ranges::find(report.multiview, quality.situation, &MultiviewQuality::situation);
    fmt::format_to(out, " {} | {} | {} |\n", losses_of(quality, "mocap_adaptive_alpha_beta"),
                   losses_of(quality, "default"), seen == report.multiview.end() ? "-" : std::to_string(seen->losses));
  }
  text +=
      "\nThe clips of the study are not published. Our clips follow laws with which the code of the study gives "
      "about its published figures, so compare a rebuilt count with the second figure, whose deviation is that of "
      "20 random clips. No such clips reach the published swapping figure of CONDENSATION (16). In the study an "
      "operator's click assigns the label; here the label belongs to the track that starts on the marker in the "
      "first frame. The situations after swapping are ours; the study has no figures for them.\n\n";
}

/// Adds the differences between the rebuilt losses and those of the study's code, in standard deviations.
void add_check(std::string& text, const Report& report) {
  auto out = std::back_inserter(text);
  text += "Difference of the rebuilt losses from the study's code, in standard deviations (0.5 if it has none):";
  for (const Situation situation : kStudied) {
    const SituationQuality* quality = find(report, situation);
    if (quality == nullptr) continue;
    fmt::format_to(out, " {}", name_of(situation));
    for (std::size_t m = 0; m < kStudyMethods.size(); ++m) {
      const MethodQuality* rebuilt = find(*quality, std::string("paper_") + kStudyMethods[m]);
      const auto original = original_code(situation, m);
      if (rebuilt == nullptr || !original) continue;
      const double of_20 = rebuilt->losses * kClipsOfTheStudy / report.settings.clips;
      fmt::format_to(out, " {:+.1f}", (of_20 - original->losses) / std::max(0.5, original->deviation));
    }
    text += ";";
  }
  text += " one run of 20 clips is expected within 2.\n\n";
}

void add_error_row(std::string& text, const std::string& name, const std::optional<ErrorFigures>& error,
                   bool with_all) {
  auto out = std::back_inserter(text);
  if (!error || error->samples == 0) {
    fmt::format_to(out, "| {} | 0 | - | - | - | ", name);
  } else {
    fmt::format_to(out, "| {} | {} | {:.2f} | {:.2f} | {:.2f} | ", name, error->samples, error->low, error->mean,
                   error->high);
  }
  text += with_all && error ? fmt::format("{:.2f} |\n", error->mean_all) : "- |\n";
}

void add_errors(std::string& text, const Report& report) {
  constexpr std::array<std::pair<Situation, const char*>, 3> kTables{
      {{Situation::Slow, "Table II: slow movements"},
       {Situation::Rapid, "Table III: rapid movements"},
       {Situation::Accelerated, "Table IV: accelerated movements"}}};
  for (const auto& [situation, title] : kTables) {
    const SituationQuality* quality = find(report, situation);
    if (quality == nullptr) continue;
    text += fmt::format(
        "## {}, px\n\n| method | samples | low | mean | high | mean of all clips |\n|---|---|---|---|---|---|\n",
        title);
    const auto add = [&](const std::string& name, const std::string& method) {
      const MethodQuality* figures = find(*quality, method);
      if (figures != nullptr) add_error_row(text, name, figures->error_px, true);
    };
    for (std::size_t m = 0; m < kStudyMethods.size(); ++m) {
      const std::string name = kNames[m];
      add_error_row(text, name + ", published", published_errors(situation, m), false);
      add(name + ", rebuilt", std::string("paper_") + kStudyMethods[m]);
      add(name + ", ours", std::string("mocap_") + kStudyMethods[m]);
    }
    add("adaptive Alpha-Beta, ours", "mocap_adaptive_alpha_beta");
    add("default", "default");
    text += "\n";
  }
  text +=
      "Samples, limits and mean cover the clips without a loss, as in the study, so a method that loses hard clips "
      "looks precise. The last column covers all clips; a lost label continues to add errors. The laws of the "
      "clips set the speed so that the rebuilt Alpha-Beta filter has about the published error; the errors of the "
      "other methods are then a test. The error of CONDENSATION is about twice the motion between frames, because "
      "its particles have no velocity. Our errors refer to the true position, the study's to the detected "
      "position; the difference is 0.1 px.\n\n";
}

const MethodCost* find_cost(const Report& report, const std::string& method) {
  const auto found = std::ranges::find(report.costs, method, &MethodCost::method);
  return found == report.costs.end() ? nullptr : &*found;
}

std::string cell(std::span<const CostRow> rows, int markers) {
  const auto found = std::ranges::find(rows, markers, &CostRow::markers);
  if (found == rows.end()) return "-";
  const CostFigures& cost = found->cost;
  return fmt::format("{:.4f} {:.4f} {:.4f} {:.4f}", cost.p5_ms, cost.median_ms, cost.p95_ms, cost.max_ms);
}

void add_costs(std::string& text, const Report& report) {
  if (report.costs.empty()) return;
  constexpr std::array kNumerals{"V", "VI", "VII"};
  auto out = std::back_inserter(text);
  for (std::size_t m = 0; m < kStudyMethods.size(); ++m) {
    const MethodCost* rebuilt = find_cost(report, std::string("paper_") + kStudyMethods[m]);
    const MethodCost* ours = find_cost(report, std::string("mocap_") + kStudyMethods[m]);
    if (rebuilt == nullptr || ours == nullptr) continue;
    fmt::format_to(out,
                   "## Table {}: cost of {} a frame, ms\n\nEach cell: 5th percentile, median, 95th percentile, "
                   "maximum.\n\n| markers | published | rebuilt | ours |\n|---|---|---|---|\n",
                   kNumerals[m], kNames[m]);
    for (const CostRow& row : ours->rows) {
      fmt::format_to(out, "| {} | {} | {} | {} |\n", row.markers, cell(published_costs(m), row.markers),
                     cell(rebuilt->rows, row.markers), cell(ours->rows, row.markers));
    }
    text += "\n";
  }
  const MethodCost* reference = find_cost(report, "cv_kalman");
  const MethodCost* chosen = find_cost(report, "default");
  if (reference != nullptr && chosen != nullptr) {
    text +=
        "## The default compared with an OpenCV implementation\n\n| markers | cv::KalmanFilter, greedy | default | "
        "ratio of medians |\n|---|---|---|---|\n";
    for (std::size_t i = 0; i < chosen->rows.size(); ++i) {
      const CostRow& ours = chosen->rows[i];
      const CostRow& theirs = reference->rows[i];
      fmt::format_to(out, "| {} | {} | {} | {:.1f} |\n", ours.markers, cell(reference->rows, ours.markers),
                     cell(chosen->rows, ours.markers), theirs.cost.median_ms / ours.cost.median_ms);
    }
  }
  text +=
      "\nPublished times are from a computer of 2010 and cannot be compared directly. The other columns are from "
      "this run, in one thread, for the tracking only. The rebuilt filters are direct implementations, not the "
      "library calls of the study, and are faster than its own code would be here. Our tracker also solves the "
      "global assignment and handles crossing markers, which the other two do not.\n";
}

}  // namespace

std::string to_markdown(const Report& report) {
  std::string text = fmt::format("# The tracking study, rebuilt\n\n{} clips a situation, seed base {}.\n\n",
                                 report.settings.clips, report.settings.seed_base);
  add_losses(text, report);
  add_check(text, report);
  add_errors(text, report);
  add_costs(text, report);
  return text;
}

}  // namespace mocap::paper_study
