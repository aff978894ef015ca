#include "eval/benchmark_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "lib/scoring/figures.h"

namespace mocap::eval {
namespace {

using Json = nlohmann::ordered_json;
using Reasons = std::array<std::uint64_t, benchmark::kWithheldReasons>;

constexpr std::size_t kListedMarkers = 8;
constexpr std::size_t kListedConfusions = 3;

std::string_view reason_text(std::size_t reason) { return text_of(static_cast<benchmark::Withheld>(reason)); }

std::uint64_t total_of(const Reasons& reasons) {
  std::uint64_t sum = 0;
  for (const std::uint64_t count : reasons) sum += count;
  return sum;
}

// The reasons with a count, most frequent first.
std::vector<std::size_t> by_count(const Reasons& reasons) {
  std::vector<std::size_t> order;
  for (std::size_t r = 0; r < reasons.size(); ++r) {
    if (reasons[r] > 0) order.push_back(r);
  }
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return reasons[a] > reasons[b]; });
  return order;
}

std::string histogram(const Reasons& reasons) {
  std::string text;
  const auto all = static_cast<double>(std::max<std::uint64_t>(1, total_of(reasons)));
  for (const std::size_t r : by_count(reasons)) {
    const double share = static_cast<double>(reasons[r]) / all;
    text += fmt::format("  {:24} {:8} {:5.1f} % {}\n", reason_text(r), reasons[r], 100.0 * share,
                        std::string(static_cast<std::size_t>(40.0 * share + 0.5), '#'));
  }
  return text;
}

std::string worst_markers(const std::map<std::string, Reasons>& of_marker) {
  std::vector<std::pair<std::string, Reasons>> all(of_marker.begin(), of_marker.end());
  std::ranges::stable_sort(all, [](const auto& a, const auto& b) { return total_of(a.second) > total_of(b.second); });
  std::string text;
  for (std::size_t i = 0; i < std::min(kListedMarkers, all.size()); ++i) {
    if (total_of(all[i].second) == 0) break;
    text += fmt::format("  {:24} {:8}  mostly {}\n", all[i].first, total_of(all[i].second),
                        reason_text(by_count(all[i].second).front()));
  }
  return text;
}

// The figures that live and offline labels share.
Json json_of(const benchmark::LabelFigures& f) {
  return {{"macro_f1", scoring::or_null(f.macro_f1)},
          {"macro_precision", scoring::or_null(f.macro_precision)},
          {"macro_recall", scoring::or_null(f.macro_recall)},
          {"accuracy", scoring::or_null(f.accuracy)},
          {"label_precision", scoring::or_null(f.label_precision)},
          {"label_recall", scoring::or_null(f.label_recall)},
          {"idf1", scoring::or_null(f.idf1)},
          {"wrong_labels", f.wrong},
          {"longest_wrong_frames", f.longest_wrong_frames},
          {"first_label_s", scoring::or_null(f.first_label_s)}};
}

Json json_of(const BenchmarkCase& one) {
  Json json = {{"take", one.take}, {"mode", text_of(one.mode)}, {"noise", one.noise}, {"seed", one.seed}};
  json["frames"] = one.run.figures.frames;
  json["points"] = one.run.figures.points;
  json["unknown_points"] = one.run.figures.unknown_points;
  json.update(json_of(one.run.figures));
  json["macro_f1_since_first_label"] = scoring::or_null(one.run.since_first.macro_f1);
  json["label_recall_since_first_label"] = scoring::or_null(one.run.since_first.label_recall);
  json["ms_per_frame"] = one.run.ms_per_frame;
  Json& withheld = json["withheld"] = Json::object();
  for (const std::size_t r : by_count(one.run.withheld)) withheld[std::string(reason_text(r))] = one.run.withheld[r];
  json["offline"] = json_of(one.run.offline);
  return json;
}

std::string svg_text(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    if (c == '<' || c == '&' || c == '>') {
      safe += c == '<' ? "&lt;" : c == '>' ? "&gt;" : "&amp;";
    } else {
      safe.push_back(c);
    }
  }
  return safe;
}

// The most frequent wrong labels of each run.
std::string wrong_labels(const BenchmarkCase& one) {
  std::string text;
  for (std::size_t i = 0; i < std::min(kListedConfusions, one.run.confusions.size()); ++i) {
    const benchmark::Confusion& wrong = one.run.confusions[i];
    text +=
        fmt::format("  wrong, {}, seed {}: {} on {} in {} frames\n", one.noise, one.seed,
                    one.markers[static_cast<std::size_t>(wrong.given)],
                    wrong.truth < 0 ? "no marker" : one.markers[static_cast<std::size_t>(wrong.truth)], wrong.points);
  }
  return text;
}

}  // namespace

std::string benchmark_header() {
  return fmt::format(
      "{:32} {:10} {:9} {:>4} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>7} {:>7} {:>7} {:>8} {:>8} {:>9}\n",
      "take", "mode", "noise", "seed", "macro F1", "since 1", "precis.", "recall", "accuracy", "IDF1", "label p",
      "label r", "longest", "first s", "ms", "off. F1", "off. p", "off. long");
}

std::string benchmark_line(const BenchmarkCase& one) {
  const benchmark::LabelFigures &f = one.run.figures, &offline = one.run.offline;
  const auto cell = scoring::cell;
  return fmt::format(
      "{:32} {:10} {:9} {:4} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8} {:7} {:>7} {:7.3f} {:>8} {:>8} {:9}\n",
      one.take, text_of(one.mode), one.noise, one.seed, cell(f.macro_f1, 4), cell(one.run.since_first.macro_f1, 4),
      cell(f.macro_precision, 4), cell(f.macro_recall, 4), cell(f.accuracy, 4), cell(f.idf1, 4),
      cell(f.label_precision, 5), cell(f.label_recall, 4), f.longest_wrong_frames, cell(f.first_label_s, 2),
      one.run.ms_per_frame, cell(offline.macro_f1, 4), cell(offline.label_precision, 5), offline.longest_wrong_frames);
}

std::string benchmark_reasons(const std::vector<BenchmarkCase>& cases) {
  std::map<std::string, std::pair<Reasons, std::map<std::string, Reasons>>> takes;  // by take and mode
  std::map<std::string, std::string> wrong;                                         // likewise
  std::map<std::string, std::uint64_t> unknown;                                     // likewise
  for (const BenchmarkCase& one : cases) {
    const std::string take = fmt::format("{}, {}", one.take, text_of(one.mode));
    auto& [all, of_marker] = takes[take];
    wrong[take] += wrong_labels(one);
    unknown[take] += one.run.figures.unknown_points;
    for (std::size_t m = 0; m < one.markers.size(); ++m) {
      for (std::size_t r = 0; r < all.size(); ++r) {
        all[r] += one.run.withheld_of[m][r];
        of_marker[one.markers[m]][r] += one.run.withheld_of[m][r];
      }
    }
  }
  std::string text;
  for (const auto& [take, reasons] : takes) {
    text += fmt::format("\n{}: {} points of markers without a label\n{}{}{}", take, total_of(reasons.first),
                        histogram(reasons.first), worst_markers(reasons.second), wrong[take]);
    if (unknown[take] > 0)
      text += fmt::format("  not counted: {} points, because the file has their marker twice\n", unknown[take]);
  }
  return text;
}

std::string benchmark_json(const std::vector<BenchmarkCase>& cases) {
  Json runs = Json::array();
  for (const BenchmarkCase& one : cases) runs.push_back(json_of(one));
  return Json{{"benchmark", "labels"}, {"runs", runs}}.dump(-1, ' ', true, Json::error_handler_t::replace);
}

Status write_benchmark_svg(const std::filesystem::path& file, const std::vector<BenchmarkCase>& cases) {
  constexpr double kLeast = 0.9, kWide_px = 400.0;
  std::string drawing = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"860\" height=\"{}\" font-family=\"sans-serif\" "
      "font-size=\"12\">\n<text x=\"10\" y=\"16\">macro F1 with the null label, 0.9 to 1</text>\n",
      30 + 18 * cases.size());
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const double f1 = cases[i].run.figures.macro_f1.value_or(0.0);
    const double y = 26.0 + 18.0 * static_cast<double>(i);
    drawing += fmt::format(
        "<text x=\"10\" y=\"{0}\">{1}</text><rect x=\"370\" y=\"{2}\" width=\"{3:.1f}\" height=\"12\" "
        "fill=\"#4a7\"/><text x=\"{4:.1f}\" y=\"{0}\">{5:.4f}</text>\n",
        y + 10.0, svg_text(fmt::format("{}, {}, {}", cases[i].take, text_of(cases[i].mode), cases[i].noise)), y,
        kWide_px * std::max(0.0, (f1 - kLeast) / (1.0 - kLeast)),
        375.0 + kWide_px * std::max(0.0, (f1 - kLeast) / (1.0 - kLeast)), f1);
  }
  std::ofstream out(file);
  out << drawing << "</svg>\n";
  if (out.flush()) return {};
  return Error{ErrorCode::Io, fmt::format("--svg '{}': cannot be written", file.string())};
}

}  // namespace mocap::eval
