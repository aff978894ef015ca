#include <fmt/core.h>
#include <unistd.h>

#include <cstdio>
#include <string>
#include <vector>

#include "base/exit_codes.h"
#include "eval/command.h"
#include "lib/cli/app.h"
#include "paper_study/plots.h"
#include "paper_study/report.h"

namespace mocap::eval {
namespace {

constexpr const char* kPaperExamples = R"(examples:
  mocap-eval paper                        every method in every situation, 20 clips each
  mocap-eval paper --markdown             tables I to VII: published, rebuilt, ours
  mocap-eval paper --seed-base 7 --json   other clips, as one JSON object
  mocap-eval paper --clips 3 --plots out  and a drawing of each clip in the folder out
  mocap-eval paper --no-cost              losses and errors alone: the machine may be busy)";

struct PaperOptions {
  paper_study::QualitySettings quality;
  std::string plots;
  bool json = false;
  bool markdown = false;
  bool no_cost = false;
  bool no_multiview = false;
};

void add_paper_options(cli::App& app, PaperOptions& options) {
  app.add_option("--seed-base", options.quality.seed_base, "seed of the random clips")->capture_default_str();
  app.add_option("--clips", options.quality.clips, "clips of each situation")
      ->check(cli::Range(1, 10000))
      ->capture_default_str();
  auto* json = app.add_flag("--json", options.json, "print one JSON object");
  app.add_flag("--markdown", options.markdown, "print the tables of the study next to our results")->excludes(json);
  app.add_option("--plots", options.plots,
                 "write drawings of the clips (SVG) to this folder, which is created if needed");
  app.add_flag("--no-cost", options.no_cost, "do not measure costs");
  app.add_flag("--no-multiview", options.no_multiview, "leave out the clips with four cameras");
  app.footer(kPaperExamples);
}

/// Shows the progress on standard error if that is a terminal.
class ProgressBar {
 public:
  explicit ProgressBar(int all) : all_(all) {}
  ~ProgressBar() {
    if (terminal_) std::fputs("\r\033[K", stderr);
  }
  void show(const char* what, int done) {
    if (!terminal_) return;
    constexpr int kWidth = 40;
    const int filled = kWidth * done / all_;
    fmt::print(stderr, "\r[{}{}] {:3} % {:<12}", std::string(static_cast<std::size_t>(filled), '#'),
               std::string(static_cast<std::size_t>(kWidth - filled), ' '), 100 * done / all_, what);
    std::fflush(stderr);
  }

 private:
  int all_;
  bool terminal_ = ::isatty(STDERR_FILENO) != 0;
};

paper_study::Report evaluate_paper(const PaperOptions& options) {
  using paper_study::Situation;
  std::vector<Situation> situations(paper_study::kStudied.begin(), paper_study::kStudied.end());
  situations.insert(situations.end(), paper_study::kHarder.begin(), paper_study::kHarder.end());
  const paper_study::CostSettings costs;
  const int one_camera = options.quality.clips * static_cast<int>(situations.size());
  const int multiview =
      options.no_multiview ? 0 : options.quality.clips * static_cast<int>(paper_study::kStudied.size());
  ProgressBar bar(one_camera + multiview + (options.no_cost ? 0 : cost_rows(costs)));

  paper_study::Report report;
  report.settings = options.quality;
  report.one_camera = paper_study::judge(options.quality, situations, [&](int done) { bar.show("one camera", done); });
  if (!options.no_multiview) {
    report.multiview = paper_study::judge_multiview(options.quality, paper_study::kStudied,
                                                    [&](int done) { bar.show("four cameras", one_camera + done); });
  }
  if (!options.no_cost) {
    report.costs =
        paper_study::measure_costs(costs, [&](int done) { bar.show("cost", one_camera + multiview + done); });
  }
  return report;
}

}  // namespace

int run_paper(int argc, const char* const* argv) {
  PaperOptions options;
  cli::App app("Rebuilds the tracking study and scores our trackers on its clips.", "mocap-eval paper");
  add_paper_options(app, options);
  if (const auto exit = app.parse(argc, argv)) return *exit;
  if (!options.plots.empty()) {
    if (const Status drawn = paper_study::draw_plots(options.quality, options.plots); !drawn) {
      fmt::print(stderr, "mocap-eval: {}\n", drawn.error().message);
      return kExitUnavailable;
    }
  }
  const paper_study::Report report = evaluate_paper(options);
  if (options.json) {
    fmt::print("{}\n", to_json(report));
  } else {
    fmt::print("{}", options.markdown ? to_markdown(report) : to_text(report));
  }
  return kExitOk;
}

}  // namespace mocap::eval
