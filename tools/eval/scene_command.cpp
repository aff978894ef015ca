#include <fmt/core.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>

#include "base/exit_codes.h"
#include "eval/command.h"
#include "eval/plots.h"
#include "eval/scene_report.h"
#include "eval/scene_run.h"
#include "lib/cli/app.h"

namespace mocap::eval {
namespace {

constexpr int kNotMet = 1;
constexpr int kBadData = 65;  // sysexits EX_DATAERR
constexpr int kNoInput = 66;  // sysexits EX_NOINPUT

constexpr const char* kHelp =
    "Simulated cameras see people move; the blobs go through the daemon's own row (align, match, triangulate, track,\n"
    "label, solve), and what comes out is compared with the truth. Blobs are computed, with the detector's noise.\n"
    "\n"
    "prec, recall, f1: of names shown as measured. Right: within 20 mm of its own marker. Recall is over markers that\n"
    "two cameras see. Judged from the subject's first name on. wrong: runs of consecutive sets in which a name is "
    "over\n"
    "20 mm off or on another marker; longest: the longest, sets. avail: share of the sets with a marker in view, "
    "after\n"
    "the first name, in which the subject is tracked with a whole skeleton. reacq: s until 90 % of the markers in "
    "view\n"
    "bear their names again after nothing was seen for 0.1 s, 95th percentile. joint: rms mm; hidden: of joints\n"
    "without a marker in view; jitter: mm, white noise that has the second difference which the error has.\n"
    "\n"
    "  mocap-eval scene config/scenes/bvh_baseline41.toml\n"
    "  mocap-eval scene config/scenes/handshake.toml --seed 3 --json --plots /tmp/plots\n"
    "  mocap-eval scene config/scenes/hidden30.toml --only dm_run --wrong 10\n";

struct Options {
  std::string file;
  std::optional<std::uint64_t> seed;
  std::string only;
  std::string plots;
  std::string snapshots;
  std::optional<double> seconds;
  std::size_t wrong = 0;
  bool json = false;
  bool demand = false;
};

// The name of a clip without folder and ending, for the files that are written about it.
std::string stem_of(const std::string& clip) {
  return clip.empty() ? "scene" : std::filesystem::path(clip).stem().string();
}

bool is_wanted(const Options& options, const std::string& clip) {
  return options.only.empty() || clip.find(options.only) != std::string::npos;
}

// A file a clip and subject, of names and of joints.
Status draw(const std::string& folder, const SceneOutcome& clip) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  const std::string stem = stem_of(clip.clip);
  for (std::uint32_t id = 0; id < clip.subjects.size(); ++id) {
    const std::string name = stem + "_" + clip.subjects[id];
    if (const auto line = clip.timelines.find(id); line != clip.timelines.end()) {
      const Status drawn =
          plot_names(folder + "/" + name + "_names.svg", "names: " + name, line->second, clip.marker_names[id]);
      if (!drawn) return drawn;
    }
    if (const auto errors = clip.errors.find(id); errors != clip.errors.end()) {
      const Status drawn = plot_errors(folder + "/" + name + "_joints.svg", "joints: " + name, errors->second);
      if (!drawn) return drawn;
    }
  }
  return {};
}

int run(const Options& options) {
  auto scene = simworld::load_scene(options.file);
  if (!scene) {
    fmt::print(stderr, "{}\n", settings::to_text(scene.error()));
    return kBadData;
  }
  if (options.seconds) scene->seconds = *options.seconds;
  SceneResults results;
  SceneRunSettings wanted{options.seed.value_or(scene->seed), true, !options.plots.empty(), {}};
  std::vector<std::string> clips = scene->clips;
  if (clips.empty()) clips.emplace_back();
  for (const std::string& clip : clips) {
    if (!is_wanted(options, clip)) continue;
    if (isatty(STDERR_FILENO) != 0) fmt::print(stderr, "\r{:<60}\r", clip);
    if (!options.snapshots.empty()) {
      std::error_code error;
      std::filesystem::create_directories(options.snapshots, error);  // the writer reports a folder that is missing
      wanted.snapshots = std::filesystem::path(options.snapshots) / (stem_of(clip) + ".pb");
    }
    auto outcome = run_scene(*scene, clip, wanted);
    if (!outcome && outcome.error().code == ErrorCode::NotFound) {
      results.skipped.push_back(outcome.error().message);
      continue;
    }
    if (!outcome) {
      fmt::print(stderr, "mocap-eval: {}\n", outcome.error().message);
      return kBadData;
    }
    results.clips.push_back(std::move(*outcome));
    if (!options.plots.empty()) {
      if (const Status drawn = draw(options.plots, results.clips.back()); !drawn) {
        fmt::print(stderr, "mocap-eval: {}\n", drawn.error().message);
        return kNoInput;
      }
    }
    if (scene->only_camera.empty()) continue;
    auto blind = run_scene(*scene, clip, {wanted.seed, false, false, {}});
    if (blind) results.without_rays.push_back(std::move(*blind));
  }
  fmt::print("{}{}", options.json ? to_json(*scene, results) : to_text(*scene, results), options.json ? "\n" : "");
  if (!options.json) fmt::print("{}", wrong_text(results, options.wrong));
  if (results.clips.empty()) return kNoInput;
  const auto goals = goals_of(*scene, results);
  const bool missed = std::ranges::any_of(goals, [](const GoalMet& goal) { return !goal.met; });
  return options.demand && missed ? kNotMet : kExitOk;
}

}  // namespace

int run_scene(int argc, const char* const* argv) {
  Options options;
  cli::App app("How well does the daemon name and pose people?", "mocap-eval scene");
  app.add_option("file", options.file, "the scene, as in config/scenes")->required();
  app.add_option("--seed", options.seed, "of noise, bodies and events; without it, the file's");
  app.add_option("--only", options.only, "run only the clips whose names have this in them");
  app.add_option("--seconds", options.seconds, "of each clip; without it, the file's")->check(cli::Range(0.1, 36000.0));
  app.add_option("--plots", options.plots, "draw what happened to the names, and the joints' errors, into this folder");
  app.add_option("--snapshots", options.snapshots, "write each clip's snapshots into this folder, as CLIP.pb");
  app.add_option("--wrong", options.wrong, "list so many of each clip's wrong names, the longest first");
  app.add_flag("--json", options.json, "print one JSON object");
  app.add_flag("--require-goals", options.demand, "exit 1 when a goal of the file is missed");
  app.footer(kHelp);
  if (const auto exit = app.parse(argc, argv)) return *exit;
  return run(options);
}

}  // namespace mocap::eval
