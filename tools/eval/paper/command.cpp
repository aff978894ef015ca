#include <fmt/core.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <vector>

#include "base/exit_codes.h"
#include "eval/command.h"
#include "eval/paper/quality.h"

namespace mocap::eval {
namespace {

struct Options {
  paper::QualitySettings quality;
  bool json = false;
};

void add_options(CLI::App& app, Options& options) {
  app.add_option("--seed-base", options.quality.seed_base, "another base gives other clips")->capture_default_str();
  app.add_option("--clips", options.quality.clips, "clips of each situation")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  app.add_flag("--json", options.json, "print one JSON object");
}

void print_progress(int done, int all) {
  std::fprintf(stderr, "\r%3d %%%s", 100 * done / all, done == all ? "\r     \r" : "");
}

nlohmann::ordered_json to_json(const std::vector<paper::SituationQuality>& qualities) {
  nlohmann::ordered_json losses, errors;
  for (const auto& quality : qualities) {
    const std::string situation = paper::name_of(quality.situation);
    for (const auto& method : quality.methods) {
      losses[situation][method.method] = method.losses;
      const auto& error = method.error_px;
      errors[situation][method.method] = {{"samples", error.samples},
                                          {"low", error.low},
                                          {"mean", error.mean},
                                          {"high", error.high},
                                          {"mean_all", error.mean_all}};
    }
  }
  return {{"losses", losses}, {"error_px", errors}};
}

void print_table(const std::vector<paper::SituationQuality>& qualities) {
  for (const auto& quality : qualities) {
    fmt::print("{}\n", paper::name_of(quality.situation));
    for (const auto& method : quality.methods) {
      fmt::print("  {:22} losses {:3}  error px {:6.2f} (all {:7.2f}), {} samples\n", method.method, method.losses,
                 method.error_px.mean, method.error_px.mean_all, method.error_px.samples);
    }
  }
}

}  // namespace

int run_paper(int argc, const char* const* argv) {
  Options options;
  CLI::App app("Rebuilds the tracking study and judges our trackers on its clips.", "mocap-eval paper");
  add_options(app, options);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& fault) {
    return app.exit(fault) == 0 ? kExitOk : kExitUsage;
  }
  std::vector<paper::Situation> situations(paper::kStudied.begin(), paper::kStudied.end());
  situations.insert(situations.end(), paper::kHarder.begin(), paper::kHarder.end());
  const bool terminal = ::isatty(STDERR_FILENO) != 0;
  const int all = options.quality.clips * static_cast<int>(situations.size());
  const auto qualities = paper::judge(options.quality, situations, [&](int done) {
    if (terminal) print_progress(done, all);
  });
  if (options.json) {
    fmt::print("{}\n", to_json(qualities).dump());
  } else {
    print_table(qualities);
  }
  return kExitOk;
}

}  // namespace mocap::eval
