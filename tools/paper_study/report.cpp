#include "paper_study/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "paper_study/published.h"

namespace mocap::paper_study {
namespace {

using Json = nlohmann::ordered_json;

Json to_json(const ErrorFigures& error, bool with_all) {
  Json object{{"samples", error.samples}, {"low", error.low}, {"mean", error.mean}, {"high", error.high}};
  if (error.samples == 0) object["low"] = object["mean"] = object["high"] = nullptr;
  object["mean_all"] = with_all ? Json(error.mean_all) : Json(nullptr);
  return object;
}

Json to_json(const CostFigures& cost) {
  return {{"p5", cost.p5_ms}, {"median", cost.median_ms}, {"p95", cost.p95_ms}, {"max", cost.max_ms}};
}

std::string published(std::size_t method) { return std::string("published_") + kStudyMethods[method]; }

Json losses_of(const Report& report) {
  Json losses = Json::object();
  for (const SituationQuality& quality : report.one_camera) {
    Json& row = losses[name_of(quality.situation)];
    for (std::size_t m = 0; m < kStudyMethods.size(); ++m) {
      if (const auto count = published_losses(quality.situation, m)) row[published(m)] = *count;
    }
    for (const MethodQuality& method : quality.methods) row[method.method] = method.losses;
  }
  return losses;
}

Json errors_of(const Report& report) {
  Json errors = Json::object();
  for (const SituationQuality& quality : report.one_camera) {
    Json& row = errors[name_of(quality.situation)];
    for (std::size_t m = 0; m < kStudyMethods.size(); ++m) {
      if (const auto error = published_errors(quality.situation, m)) row[published(m)] = to_json(*error, false);
    }
    for (const MethodQuality& method : quality.methods) row[method.method] = to_json(method.error_px, true);
  }
  return errors;
}

Json costs_of(const Report& report) {
  Json costs = Json::object();
  if (report.costs.empty()) return costs;
  for (std::size_t m = 0; m < kStudyMethods.size(); ++m) {
    for (const CostRow& row : published_costs(m)) costs[published(m)][std::to_string(row.markers)] = to_json(row.cost);
  }
  for (const MethodCost& method : report.costs) {
    for (const CostRow& row : method.rows) costs[method.method][std::to_string(row.markers)] = to_json(row.cost);
  }
  return costs;
}

}  // namespace

std::string to_json(const Report& report) {
  Json multiview = Json::object();
  for (const MultiviewQuality& quality : report.multiview) multiview[name_of(quality.situation)] = quality.losses;
  const Json object{{"clips", report.settings.clips}, {"seed_base", report.settings.seed_base},
                    {"losses", losses_of(report)},    {"error_px", errors_of(report)},
                    {"multiview_losses", multiview},  {"cost_ms", costs_of(report)}};
  return object.dump();
}

std::string to_text(const Report& report) {
  std::string text;
  for (const SituationQuality& quality : report.one_camera) {
    text += fmt::format("{}: losses of {}; mean prediction error without and with lost clips\n",
                        name_of(quality.situation), report.settings.clips);
    for (const MethodQuality& method : quality.methods) {
      const ErrorFigures& error = method.error_px;
      const std::string kept = error.samples > 0 ? fmt::format("{:6.2f} px", error.mean) : "     -   ";
      text += fmt::format("  {:26} {:3}   {} {:7.2f} px\n", method.method, method.losses, kept, error.mean_all);
    }
  }
  for (const MultiviewQuality& quality : report.multiview) {
    text += fmt::format("{} with {} cameras, whole chain: {} lost of {}\n", name_of(quality.situation),
                        kMultiviewCameras, quality.losses, report.settings.clips);
  }
  for (const MethodCost& method : report.costs) {
    for (const CostRow& row : method.rows) {
      if (row.markers != 30 && row.markers != 1000) continue;
      text += fmt::format("cost {:26} {:4} markers: median {:8.2f} us, p95 {:8.2f} us{}\n", method.method, row.markers,
                          1e3 * row.cost.median_ms, 1e3 * row.cost.p95_ms, row.kept_all ? "" : "  (names changed)");
    }
  }
  return text;
}

}  // namespace mocap::paper_study
