#include <fmt/core.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>

#include "base/exit_codes.h"
#include "eval/command.h"
#include "eval/scene_report.h"
#include "eval/scene_run.h"
#include "lib/cli/app.h"
#include "score/plots.h"

namespace mocap::eval {
namespace {

constexpr int kNotMet = 1;

constexpr const char* kSceneHelp =
    "Simulated cameras see moving people. The blobs pass the daemon's own pipeline (align, match, triangulate,\n"
    "track, label, solve), and the result is compared with the truth. Blobs are computed with a model of the\n"
    "detector's noise.\n"
    "\n"
    "prec, recall, f1: of the measured labels. A label is right within 20 mm of its own marker. Recall is over\n"
    "markers that two cameras see. Scoring begins with the subject's first label. wrong: runs of consecutive\n"
    "sets in which a label is over 20 mm off or on another marker; longest: the longest run, sets. avail: share\n"
    "of the sets with a visible marker, after the first label, in which the subject is tracked with a complete\n"
    "skeleton. reacq: after 0.1 s without a visible marker, time in s until 90 % of the visible markers have\n"
    "their labels again, 95th percentile. joint: rms in mm; hidden: joints without a visible marker; jitter:\n"
    "mm, standard deviation of white noise with the second difference of the error.\n"
    "\n"
    "examples:\n"
    "  mocap-eval scene config/scenes/bvh_baseline41.toml\n"
    "  mocap-eval scene config/scenes/handshake.toml --seed 3 --json --plots /tmp/plots\n"
    "  mocap-eval scene config/scenes/hidden30.toml --only dm_run --wrong 10\n";

struct SceneOptions {
  std::string file;
  std::optional<std::uint64_t> seed;
  std::string only;
  std::string plots;
  std::string snapshots;
  std::optional<double> seconds;
  std::size_t wrong = 0;
  bool reasons = false;
  bool json = false;
  bool demand = false;
  bool offline = false;
};

// The file name of a clip without folder and extension, for the names of output files.
std::string stem_of(const std::string& clip) {
  return clip.empty() ? "scene" : std::filesystem::path(clip).stem().string();
}

bool is_wanted(const SceneOptions& options, const std::string& clip) {
  return options.only.empty() || clip.find(options.only) != std::string::npos;
}

// Writes one plot of the labels and one plot of the joints for each subject of a clip.
Status draw(const std::string& folder, const SceneOutcome& clip) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  const std::string stem = stem_of(clip.clip);
  for (std::uint32_t id = 0; id < clip.subjects.size(); ++id) {
    const std::string name = stem + "_" + clip.subjects[id];
    if (const auto line = clip.timelines.find(id); line != clip.timelines.end()) {
      const Status drawn =
          score::plot_names(folder + "/" + name + "_names.svg", "labels: " + name, line->second, clip.marker_names[id]);
      if (!drawn) return drawn;
    }
    if (const auto errors = clip.errors.find(id); errors != clip.errors.end()) {
      const Status drawn = score::plot_errors(folder + "/" + name + "_joints.svg", "joints: " + name, errors->second);
      if (!drawn) return drawn;
    }
  }
  return {};
}

int evaluate_scene(const SceneOptions& options) {
  auto scene = simworld::load_scene(options.file);
  if (!scene) {
    fmt::print(stderr, "{}\n", settings::to_text(scene.error()));
    return kExitData;
  }
  if (options.seconds) scene->seconds = *options.seconds;
  SceneResults results;
  SceneRunSettings wanted{options.seed.value_or(scene->seed), true, !options.plots.empty(), options.offline, {}};
  std::vector<std::string> clips = scene->clips;
  if (clips.empty()) clips.emplace_back();
  for (const std::string& clip : clips) {
    if (!is_wanted(options, clip)) continue;
    if (isatty(STDERR_FILENO) != 0) fmt::print(stderr, "\r{:<60}\r", clip);
    if (!options.snapshots.empty()) {
      std::error_code error;
      std::filesystem::create_directories(options.snapshots,
                                          error);  // the writer reports an error if the folder is missing
      wanted.snapshots = std::filesystem::path(options.snapshots) / (stem_of(clip) + ".pb");
    }
    auto outcome = run_scene(*scene, clip, wanted);
    if (!outcome && outcome.error().code == ErrorCode::NotFound) {
      results.skipped.push_back(outcome.error().message);
      continue;
    }
    if (!outcome) {
      fmt::print(stderr, "mocap-eval: {}\n", outcome.error().message);
      return kExitData;
    }
    results.clips.push_back(std::move(*outcome));
    if (!options.plots.empty()) {
      if (const Status drawn = draw(options.plots, results.clips.back()); !drawn) {
        fmt::print(stderr, "mocap-eval: {}\n", drawn.error().message);
        return kExitNoInput;
      }
    }
    if (scene->only_camera.empty()) continue;
    auto blind = run_scene(*scene, clip, {wanted.seed, false, false, options.offline, {}});
    if (blind) results.without_rays.push_back(std::move(*blind));
  }
  fmt::print("{}{}", options.json ? to_json(*scene, results) : to_text(*scene, results), options.json ? "\n" : "");
  if (!options.json) fmt::print("{}", wrong_text(results, options.wrong));
  if (options.reasons && !options.json) fmt::print("{}", reasons_text(results));
  if (results.clips.empty()) return kExitNoInput;
  const auto goals = goals_of(*scene, results);
  const bool missed = std::ranges::any_of(goals, [](const GoalMet& goal) { return !goal.met; });
  return options.demand && missed ? kNotMet : kExitOk;
}

}  // namespace

int run_scene(int argc, const char* const* argv) {
  SceneOptions options;
  cli::App app("Scores labels and skeletons in a simulated scene.", "mocap-eval scene");
  app.add_option("file", options.file, "scene file, as in config/scenes")->required();
  app.add_option("--seed", options.seed, "seed of noise, bodies and events; default: seed of the file");
  app.add_option("--only", options.only, "run only clips whose names contain this text");
  app.add_option("--seconds", options.seconds, "duration of each clip, s; default: seconds of the file")
      ->check(cli::Range(0.1, 36000.0));
  app.add_option("--plots", options.plots, "write plots of labels and joint errors to this folder");
  app.add_option("--snapshots", options.snapshots,
                 "write the snapshots of each clip to this folder, as CLIP.pb, or CLIP-2.pb if it exists");
  app.add_option("--wrong", options.wrong, "list this number of wrong labels for each clip, longest first");
  app.add_flag("--offline", options.offline,
               "score the clip tracked again forwards and backwards, as mocapctl take retrack --preset offline does");
  app.add_flag("--reasons", options.reasons, "list why a subject was not found, once a second while it is missing");
  app.add_flag("--json", options.json, "print one JSON object");
  app.add_flag("--require-goals", options.demand, "exit 1 if a goal of the file is missed");
  app.footer(kSceneHelp);
  if (const auto exit = app.parse(argc, argv)) return *exit;
  return evaluate_scene(options);
}

}  // namespace mocap::eval
