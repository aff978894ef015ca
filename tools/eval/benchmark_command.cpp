#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/exit_codes.h"
#include "eval/benchmark_report.h"
#include "eval/benchmark_words.h"
#include "eval/command.h"
#include "eval/skeleton_benchmark.h"
#include "lib/benchmark/label_run.h"
#include "lib/cli/app.h"
#include "lib/cli/commands.h"

namespace mocap::eval {
namespace {

namespace fs = std::filesystem;

constexpr const char* kBenchmarkLabelsExamples =
    R"(The points of a labelled recording lose their labels, get noise, and are tracked
and labelled by the daemon's own steps (3D tracks, labels, skeleton), live.
Points take the place of triangulated markers: no camera is simulated.

modes: given (body fitted to the take), static (body fitted to --static),
calibrated (marker set 5 % too large, body learnt from a T-pose), cold (that
marker set only, searched for in any pose).
noise: none, soma (each frame 0 to 4 hidden, ghosts), hidden5 (exactly 5),
cuts50 (soma, 50 cut tracks), studio (0.65 % hidden in rare long gaps),
uniform10 and uniform30 (hidden for 0.5 s each).

macro F1, precision and recall are means over all labels and the label of no
marker; label recall and precision count points. The column "since 1" is macro
F1 from the first frame with a label on. All are live, but for "off.": offline,
with a second pass from the last frame to the first (F1, precision, longest).

examples:
  mocap-eval benchmark labels a.c3d b.trc --noise soma,studio --modes given
  mocap-eval benchmark labels move.c3d --static t.c3d --modes static --reasons
  mocap-eval benchmark labels roll.c3d --marker-set m.toml --json --svg f1.svg
)";

struct BenchmarkLabelsOptions {
  std::vector<std::string> takes;
  std::string static_trial, marker_set;
  std::string noise = "none,soma,hidden5,cuts50,studio,uniform10,uniform30";
  std::string modes = "given,calibrated,cold";
  std::uint64_t first_seed = 1;
  int seeds = 1;
  bool json = false, reasons = false;
  fs::path svg;
};

int fail_benchmark(const Error& error) {
  fmt::print(stderr, "mocap-eval: {}\n", error.message);
  return error.code == ErrorCode::InvalidArgument ? kExitData : kExitNoInput;
}

Result<BenchmarkCase> case_of(const std::string& mode_name, const std::string& noise_name) {
  const auto mode = benchmark::mode_named(mode_name);
  if (!mode) return unknown_word("--modes", mode_name, benchmark::kModeNames);
  const auto noise = benchmark::noise_named(noise_name);
  if (!noise) return unknown_word("--noise", noise_name, benchmark::kNoiseNames);
  return BenchmarkCase{"", *mode, noise_name, 0, {}, {}};
}

// The cases of each take: all modes with all noises.
Result<std::vector<BenchmarkCase>> cases_of(const BenchmarkLabelsOptions& options) {
  std::vector<BenchmarkCase> cases;
  for (const std::string& mode : words_of(options.modes)) {
    for (const std::string& noise : words_of(options.noise)) {
      auto one = case_of(mode, noise);
      if (!one) return one.error();
      if (one->mode == benchmark::BodyKnown::Static && options.static_trial.empty()) {
        return Error{ErrorCode::InvalidArgument, "--modes static: give the static trial with --static FILE"};
      }
      cases.push_back(*std::move(one));
    }
  }
  return cases;
}

// The static trial with the markers of the clip, in the order of the clip.
bodyfit::LabelledTake with_markers_of(const benchmark::LabelledClip& clip, const benchmark::LabelledClip& trial) {
  bodyfit::LabelledTake take{clip.marker_set.markers.size(), {}};
  for (std::size_t frame = 0; frame < trial.frames(); ++frame) {
    for (const MarkerOnBone& marker : clip.marker_set.markers) {
      const auto same = std::ranges::find(trial.marker_set.markers, marker.name, &MarkerOnBone::name);
      const auto index = static_cast<std::size_t>(same - trial.marker_set.markers.begin());
      const bool known = same != trial.marker_set.markers.end();
      take.places_m.push_back(known ? trial.take.frame(frame)[index] : Eigen::Vector3d::Constant(std::nan("")));
    }
  }
  return take;
}

Status run_take(const std::string& file, const BenchmarkLabelsOptions& options, const std::vector<BenchmarkCase>& cases,
                std::vector<BenchmarkCase>& results) {
  std::optional<fs::path> marker_set;
  if (!options.marker_set.empty()) marker_set = options.marker_set;
  const auto clip = benchmark::load_labelled_clip(file, marker_set);
  if (!clip) return clip.error();
  bodyfit::LabelledTake static_trial;
  if (!options.static_trial.empty()) {
    const auto trial = benchmark::load_labelled_clip(options.static_trial, marker_set);
    if (!trial) return trial.error();
    static_trial = with_markers_of(*clip, *trial);
  }
  for (BenchmarkCase one : cases) {
    for (int seed = 0; seed < options.seeds; ++seed) {
      one.take = clip->name;
      one.seed = options.first_seed + static_cast<std::uint64_t>(seed);
      auto run = benchmark::run_labels(*clip, {one.mode, *benchmark::noise_named(one.noise), one.seed, &static_trial});
      if (!run) return run.error();
      one.run = *std::move(run);
      one.markers.clear();
      for (const MarkerOnBone& marker : clip->marker_set.markers) one.markers.push_back(marker.name);
      results.push_back(one);
      if (!options.json) {
        fmt::print("{}", (results.size() == 1 ? benchmark_header() : std::string()) + benchmark_line(one));
        std::fflush(stdout);
      }
    }
  }
  return {};
}

int run_benchmark_labels(int argc, const char* const* argv) {
  BenchmarkLabelsOptions options;
  cli::App app("Scores the labels of recordings with true labels.", "mocap-eval benchmark labels");
  app.add_option("takes", options.takes, "C3D or TRC files with labels")->required();
  app.add_option("--noise", options.noise, "kinds of noise, separated by commas")->capture_default_str();
  app.add_option("--modes", options.modes, "what the daemon knows of the body, separated by commas")
      ->capture_default_str();
  app.add_option("--static", options.static_trial, "static trial of the same person, for the mode static");
  app.add_option("--marker-set", options.marker_set,
                 "marker set file; default: by the labels, or by the motion if they follow no convention");
  app.add_option("--seeds", options.seeds, "runs with different noise")
      ->check(cli::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--first-seed", options.first_seed)->capture_default_str();
  app.add_flag("--reasons", options.reasons, "print why labels were withheld, and of which markers");
  app.add_option("--svg", options.svg, "write a drawing of macro F1 to this file");
  app.add_flag("--json", options.json, "print one JSON object");
  app.footer(kBenchmarkLabelsExamples);
  if (const auto exit = app.parse(argc, argv)) return *exit;

  const auto cases = cases_of(options);
  if (!cases) return fail_benchmark(cases.error());
  std::vector<BenchmarkCase> results;
  for (const std::string& take : options.takes) {
    if (const Status done = run_take(take, options, *cases, results); !done) return fail_benchmark(done.error());
  }
  if (options.json) fmt::print("{}\n", benchmark_json(results));
  if (options.reasons && !options.json) fmt::print("{}", benchmark_reasons(results));
  if (options.svg.empty()) return 0;
  const Status drawn = write_benchmark_svg(options.svg, results);
  return drawn ? 0 : fail_benchmark(drawn.error());
}

}  // namespace

int run_benchmark(int argc, const char* const* argv) {
  static constexpr cli::Command kCommands[] = {
      {"labels", "labels of recordings with true labels, with noise", run_benchmark_labels},
      {"skeleton", "joints and rotations of simulated people, with noise", run_benchmark_skeleton}};
  static constexpr cli::Program kProgram{"mocap-eval benchmark",
                                         "figures that others can check, on recordings with truth", kCommands,
                                         "examples:\n  mocap-eval benchmark labels walk.c3d --noise soma\n"
                                         "  mocap-eval benchmark skeleton walk.bvh --soft-tissue 8\n"};
  return cli::run_command(kProgram, argc, argv);
}

}  // namespace mocap::eval
