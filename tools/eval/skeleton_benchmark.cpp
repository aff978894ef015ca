#include "eval/skeleton_benchmark.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/exit_codes.h"
#include "eval/benchmark_words.h"
#include "lib/benchmark/posed_clip.h"
#include "lib/benchmark/skeleton_run.h"
#include "lib/cli/app.h"
#include "settings/shipped_files.h"

namespace mocap::eval {
namespace {

namespace fs = std::filesystem;

constexpr const char* kBenchmarkSkeletonExamples =
    R"(A body moves as a BVH file says, or as a program of acts says (walk:5,wave); its
markers get noise and no labels, and the daemon's own steps (3D tracks, labels,
skeleton) track it live. Points take the place of triangulated markers.

Each clip begins with 2 s of T-pose and 1 s of transition, without noise and not
scored.

modes: given (the true body), first5 (body fitted to the labelled markers of the
first 5 s), all (of the whole clip), live (marker set alone, as of an unknown
person), bound (no run: the Cramer-Rao bound of a solver of single frames that
is given body and labels; of interest with --soft-tissue).
noise: none, solver (MoCap-Solver: in each frame a share of min(|N(0,0.1)|,0.2)
hidden, as many shifted by up to 0.3 m), and those of benchmark labels.

columns: mean distance of the joints from their true positions, its 99th
percentile, mean angle of the bones' rotations in the world, frames with a pose,
CPU time a frame.

examples:
  mocap-eval benchmark skeleton walk.bvh --soft-tissue 8 --noise none,solver
  mocap-eval benchmark skeleton walk:10,wave --modes given --occlusion 8
  mocap-eval benchmark skeleton run.bvh --size 0.92 --marker-error 5 --json
)";

struct BenchmarkSkeletonOptions {
  std::vector<std::string> motions;
  std::string marker_set;
  std::string noise = "none,solver";
  std::string modes = fmt::format("{}", fmt::join(benchmark::kSkeletonModes, ","));
  benchmark::PosedClipSettings clip;
  int seeds = 1;
  bool json = false, bones = false;
};

struct SkeletonCase {
  std::string clip, mode, noise;
  std::uint64_t seed = 0;
  benchmark::SkeletonFigures figures = {};
};

int fail_skeleton(const Error& error) {
  fmt::print(stderr, "mocap-eval: {}\n", error.message);
  return error.code == ErrorCode::InvalidArgument ? kExitData : kExitNoInput;
}

std::string skeleton_line(const SkeletonCase& one) {
  const benchmark::SkeletonFigures& f = one.figures;
  const auto figure = [](double value) { return std::isnan(value) ? std::string("-") : fmt::format("{:.2f}", value); };
  return fmt::format("{:<22} {:<7} {:<9} {:>4} {:>9} {:>9} {:>9} {:>8.4f} {:>6.2f}\n", one.clip, one.mode, one.noise,
                     one.seed, figure(f.joint_cm), figure(f.joint_p99_cm), figure(f.rotation_deg), f.posed_share,
                     f.ms_per_frame);
}

std::string bone_lines(const SkeletonCase& one) {
  std::string text;
  for (const benchmark::BoneFigures& bone : one.figures.bones) {
    text += fmt::format("  {:<43} {:>9.2f} {:>19.2f}\n", bone.bone, bone.joint_cm, bone.rotation_deg);
  }
  return text;
}

nlohmann::ordered_json json_of(const SkeletonCase& one) {
  const benchmark::SkeletonFigures& f = one.figures;
  nlohmann::ordered_json bones = nlohmann::ordered_json::object();
  for (const benchmark::BoneFigures& bone : f.bones) {
    bones[bone.bone] = {{"joint_cm", bone.joint_cm}, {"rotation_deg", bone.rotation_deg}};
  }
  return {{"clip", one.clip},
          {"mode", one.mode},
          {"noise", one.noise},
          {"seed", one.seed},
          {"frames", f.frames},
          {"joint_cm", f.joint_cm},
          {"joint_p99_cm", f.joint_p99_cm},
          {"rotation_deg", f.rotation_deg},
          {"posed_share", f.posed_share},
          {"ms_per_frame", f.ms_per_frame},
          {"bones", bones}};
}

// The words of both lists, as they were given, if all of them are known.
Result<std::vector<SkeletonCase>> skeleton_cases_of(const BenchmarkSkeletonOptions& options) {
  std::vector<SkeletonCase> cases;
  for (const std::string& mode : words_of(options.modes)) {
    if (!benchmark::skeleton_mode_named(mode)) return unknown_word("--modes", mode, benchmark::kSkeletonModes);
    for (const std::string& noise : words_of(options.noise)) {
      if (!benchmark::noise_named(noise)) return unknown_word("--noise", noise, benchmark::kNoiseNames);
      cases.push_back({"", mode, noise});
    }
  }
  return cases;
}

Result<fs::path> marker_set_file(const BenchmarkSkeletonOptions& options) {
  if (!options.marker_set.empty()) return fs::path(options.marker_set);
  const settings::FoundFile found = settings::find_shipped("markersets/baseline41.toml", {});
  if (!found.missing.empty()) return Error{ErrorCode::NotFound, "marker set: " + found.missing};
  return found.path;
}

Status run_motion(const std::string& motion, const fs::path& marker_set, const BenchmarkSkeletonOptions& options,
                  const std::vector<SkeletonCase>& cases, std::vector<SkeletonCase>& results) {
  for (int i = 0; i < options.seeds; ++i) {
    benchmark::PosedClipSettings settings = options.clip;
    settings.seed += static_cast<std::uint64_t>(i);
    const auto clip = benchmark::make_posed_clip(motion, marker_set, settings);
    if (!clip) return clip.error();
    for (SkeletonCase one : cases) {
      one.clip = clip->clip.name;
      one.seed = settings.seed;
      const auto figures = benchmark::run_skeleton(*clip, *benchmark::skeleton_mode_named(one.mode),
                                                   *benchmark::noise_named(one.noise), one.seed);
      if (!figures) return figures.error();
      one.figures = *figures;
      if (!options.json) fmt::print("{}{}", skeleton_line(one), options.bones ? bone_lines(one) : "");
      std::fflush(stdout);
      results.push_back(std::move(one));
    }
  }
  return {};
}

}  // namespace

int run_benchmark_skeleton(int argc, const char* const* argv) {
  BenchmarkSkeletonOptions options;
  cli::App app("Scores joints and rotations of simulated people with known bones.", "mocap-eval benchmark skeleton");
  app.add_option("motions", options.motions, "BVH files, or acts as walk:5,wave")->required();
  app.add_option("--noise", options.noise, "kinds of noise, separated by commas")->capture_default_str();
  app.add_option("--modes", options.modes, "what the daemon knows of the body, separated by commas")
      ->capture_default_str();
  app.add_option("--marker-set", options.marker_set, "marker set file; default: baseline41");
  app.add_option("--soft-tissue", options.clip.soft_tissue_mm, "rms motion of a marker on its bone, mm")
      ->check(cli::Range(0.0, 100.0))
      ->capture_default_str();
  app.add_option("--marker-error", options.clip.marker_error_mm,
                 "deviation of the true marker offsets from the marker set, mm, each axis")
      ->check(cli::Range(0.0, 100.0))
      ->capture_default_str();
  app.add_option("--size", options.clip.size, "of the body, relative to the marker set")
      ->check(cli::Range(0.5, 2.0))
      ->capture_default_str();
  app.add_option("--occlusion", options.clip.occlusion_cameras,
                 "cameras on a ring of which two must see a marker past the body; 0: none")
      ->check(cli::Range(0, 64))
      ->capture_default_str();
  app.add_option("--seconds", options.clip.seconds, "scored time of each clip")
      ->check(cli::Range(1.0, 3600.0))
      ->capture_default_str();
  app.add_option("--rate", options.clip.rate_hz, "frames a second")
      ->check(cli::Range(10.0, 1000.0))
      ->capture_default_str();
  app.add_option("--seeds", options.seeds, "runs with different bodies, soft tissue and noise")
      ->check(cli::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--first-seed", options.clip.seed)->capture_default_str();
  app.add_flag("--bones", options.bones, "also the figures of each bone");
  app.add_flag("--json", options.json, "print one JSON object");
  app.footer(kBenchmarkSkeletonExamples);
  if (const auto exit = app.parse(argc, argv)) return *exit;

  const auto cases = skeleton_cases_of(options);
  if (!cases) return fail_skeleton(cases.error());
  const auto marker_set = marker_set_file(options);
  if (!marker_set) return fail_skeleton(marker_set.error());
  if (!options.json) {
    fmt::print("{:<22} {:<7} {:<9} {:>4} {:>9} {:>9} {:>9} {:>8} {:>6}\n", "clip", "mode", "noise", "seed", "joint cm",
               "p99 cm", "degrees", "posed", "ms");
  }
  std::vector<SkeletonCase> results;
  for (const std::string& motion : options.motions) {
    if (const Status done = run_motion(motion, *marker_set, options, *cases, results); !done) {
      return fail_skeleton(done.error());
    }
  }
  if (!options.json) return 0;
  nlohmann::ordered_json json{{"runs", nlohmann::ordered_json::array()}};
  for (const SkeletonCase& one : results) json["runs"].push_back(json_of(one));
  fmt::print("{}\n", json.dump());
  return 0;
}

}  // namespace mocap::eval
