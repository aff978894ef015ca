#include <fmt/core.h>

#include <chrono>
#include <string>
#include <vector>

#include "base/exit_codes.h"
#include "calibration/diagnosis/diagnose_rig.h"
#include "eval/command.h"
#include "lib/cli/app.h"
#include "lib/simworld/faulty_rig.h"

namespace mocap::eval {
namespace {

using calibration::RigDiagnosis;
using calibration::RigFault;
using calibration::RigFinding;
using simworld::PlantedFault;

constexpr const char* kRigsHelp =
    "Blobs of each scene and seed are recorded once with a rig that fits and once for each fault: two cameras\n"
    "exchanged, turned by 3 degrees, upside down, other lens, other rig, mirrored, one frame late. The diagnosis of\n"
    "mocap-calibrate verify and mocapctl doctor must find each fault, and no other.\n"
    "found: the fault and the camera. blamed: the camera, but another cause. missed: nothing. wrong: findings about\n"
    "other cameras; in a rig without a fault these are false alarms.\n"
    "\n"
    "examples:\n"
    "  mocap-eval rigs config/scenes/walk_about.toml --seeds 5\n"
    "  mocap-eval rigs config/scenes/*.toml --healthy --seeds 3\n";

struct RigsOptions {
  std::vector<std::string> scenes;
  double seconds = 10.0;
  std::uint64_t first_seed = 1;
  int seeds = 1;
  bool healthy = false;
  bool verbose = false;
};

/// Counts of the runs with one fault.
struct RigsScore {
  int runs = 0;
  int found = 0;
  int blamed = 0;
  int missed = 0;
  int wrong = 0;
  int undetermined = 0;  ///< cameras, in all runs
  double slowest_s = 0.0;
};

bool is_exchange_of(const RigFinding& finding, std::size_t a, std::size_t b) {
  const std::pair pair{std::min(a, b), std::max(a, b)};
  if (std::pair{finding.camera, finding.other} == pair) return true;
  return std::ranges::find(finding.alternatives, pair) != finding.alternatives.end();
}

bool is_the_fault(const RigFinding& finding, PlantedFault fault, const simworld::FaultyRecording& made) {
  switch (fault) {
    case PlantedFault::None: return false;
    case PlantedFault::Exchanged:
      return finding.fault == RigFault::Exchanged && is_exchange_of(finding, made.camera, made.other);
    case PlantedFault::OtherRig: return finding.fault == RigFault::OtherRig;
    case PlantedFault::Turned: return finding.camera == made.camera && finding.fault == RigFault::OtherPose;
    case PlantedFault::UpsideDown: return finding.camera == made.camera && finding.fault == RigFault::UpsideDown;
    case PlantedFault::OtherLens: return finding.camera == made.camera && finding.fault == RigFault::OtherLens;
    case PlantedFault::Mirrored: return finding.camera == made.camera && finding.fault == RigFault::MirroredSides;
    case PlantedFault::Late: return finding.camera == made.camera && finding.fault == RigFault::OneFrameLate;
  }
  return false;
}

void add(const RigDiagnosis& diagnosis, PlantedFault fault, const simworld::FaultyRecording& made, RigsScore& score) {
  bool found = false;
  bool blamed = false;
  for (const RigFinding& finding : diagnosis.findings) {
    const bool is_it = is_the_fault(finding, fault, made);
    const bool is_camera = fault != PlantedFault::None && finding.fault != RigFault::OtherRig &&
                           (finding.camera == made.camera || fault == PlantedFault::OtherRig);
    found = found || is_it;
    blamed = blamed || is_camera;
    score.wrong += is_it || is_camera ? 0 : 1;
  }
  ++score.runs;
  score.found += found ? 1 : 0;
  score.blamed += !found && blamed ? 1 : 0;
  score.missed += fault != PlantedFault::None && !found && !blamed ? 1 : 0;
  score.undetermined += static_cast<int>(diagnosis.undetermined.size());
}

Status run_one(const simworld::SceneFile& scene, const std::string& clip, PlantedFault fault, std::uint64_t seed,
               const RigsOptions& options, RigsScore& score) {
  const auto made = simworld::record_with_fault(scene, clip, fault, seed, options.seconds);
  if (!made) return made.error();
  const auto began = std::chrono::steady_clock::now();
  const RigDiagnosis diagnosis = calibration::diagnose_rig(made->rig, made->blobs);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
  score.slowest_s = std::max(score.slowest_s, took.count());
  add(diagnosis, fault, *made, score);
  if (!options.verbose) return {};
  fmt::print("  seed {} {} {} (camera {}, other {}), {:.2f} s, shares", seed, clip, name_of(fault), made->camera,
             made->other, took.count());
  for (const double share : diagnosis.share) fmt::print(" {:.2f}", share);
  fmt::print(", undetermined {}\n", diagnosis.undetermined.size());
  for (const RigFinding& finding : diagnosis.findings)
    fmt::print("    z {:.1f}: {}\n", finding.statistic, calibration::sentence_of(finding, made->rig));
  return {};
}

Status run_fault(const simworld::SceneFile& scene, PlantedFault fault, const RigsOptions& options) {
  RigsScore score;
  std::vector<std::string> clips = scene.clips;
  if (clips.empty()) clips.emplace_back();
  for (int i = 0; i < options.seeds; ++i) {
    const std::uint64_t seed = options.first_seed + static_cast<std::uint64_t>(i);
    const std::string& clip = clips[seed % clips.size()];
    if (const Status ran = run_one(scene, clip, fault, seed, options, score); !ran) return ran;
  }
  fmt::print("{:<24} {:<15} runs {:>3} found {:>3} blamed {:>2} missed {:>2} wrong {:>2} undetermined {:>3} {:.2f} s\n",
             scene.path.stem().string(), name_of(fault), score.runs, score.found, score.blamed, score.missed,
             score.wrong, score.undetermined, score.slowest_s);
  std::fflush(stdout);
  return {};
}

int evaluate_rigs(const RigsOptions& options) {
  for (const std::string& path : options.scenes) {
    const auto scene = simworld::load_scene(path);
    if (!scene) {
      fmt::print(stderr, "{}\n", settings::to_text(scene.error()));
      return kExitData;
    }
    std::vector<PlantedFault> faults{PlantedFault::None};
    if (!options.healthy)
      faults.insert(faults.end(), std::begin(simworld::kPlantedFaults), std::end(simworld::kPlantedFaults));
    for (const PlantedFault fault : faults) {
      if (const Status ran = run_fault(*scene, fault, options); !ran) {
        fmt::print(stderr, "mocap-eval: {}\n", ran.error().message);
        return kExitData;
      }
    }
  }
  return 0;
}

}  // namespace

int run_rigs(int argc, const char* const* argv) {
  RigsOptions options;
  cli::App app("Scores the diagnosis of cameras that do not fit the rig.", "mocap-eval rigs");
  app.add_option("scenes", options.scenes, "scene files, as in config/scenes")->required();
  app.add_option("--seconds", options.seconds, "duration of each recording, s")
      ->check(cli::Range(1.0, 600.0))
      ->capture_default_str();
  app.add_option("--seeds", options.seeds)->check(cli::Range(1, 1000))->capture_default_str();
  app.add_option("--first-seed", options.first_seed)->capture_default_str();
  app.add_flag("--healthy", options.healthy, "only rigs without a fault");
  app.add_flag("--verbose", options.verbose, "print the findings of each run");
  app.footer(kRigsHelp);
  if (const auto exit = app.parse(argc, argv)) return *exit;
  return evaluate_rigs(options);
}

}  // namespace mocap::eval
