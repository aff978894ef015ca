#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "base/exit_codes.h"
#include "eval/command.h"
#include "eval/marker_pipeline.h"
#include "eval/points_ghosts.h"
#include "eval/points_score.h"
#include "lib/cli/app.h"
#include "lib/simworld/points_motion.h"
#include "lib/simworld/points_world.h"

namespace mocap::eval {
namespace {

constexpr const char* kPointsExamples =
    "Simulated cameras look at moving markers. The blobs pass the daemon's own steps (align, match,\n"
    "triangulate, track), and the result is compared with the truth.\n"
    "\n"
    "rms_mm is the error of triangulated points, bound_mm the Cramer-Rao bound with the true rays and noise.\n"
    "nees is the normalised estimation error squared; nees_expected (3) for a consistent covariance.\n"
    "recall_3plus and recall_2 (of markers that a track predicted) count triangulated points by the number of\n"
    "cameras that have a blob of the marker alone. ghosts are confirmed tracks without a marker. id_changes: a\n"
    "marker has a different track than before.\n"
    "\n"
    "examples:\n"
    "  mocap-eval points --markers 80 --false 0.1 --seeds 3\n"
    "  mocap-eval points --motion walk.c3d --cameras 8 --rate 25 --noise-px 0.1 --json\n"
    "  mocap-eval points --motion dance.bvh --visibility measured --merge --misses 0.01 --seconds 5\n";

struct PointsOptions {
  std::string motion;
  std::size_t markers = 0;
  simworld::WorldSettings world;
  int seeds = 1;
  std::uint64_t first_seed = 1;
  std::optional<double> seconds;
  std::optional<double> rate_hz;
  bool json = false;
  bool list_faults = false;
};

int fail(const Error& error) {
  fmt::print(stderr, "mocap-eval: {}\n", error.message);
  return error.code == ErrorCode::InvalidArgument ? kExitData : kExitNoInput;
}

void add_points_options(cli::App& app, PointsOptions& options) {
  simworld::WorldSettings& world = options.world;
  app.add_option("--motion", options.motion, "a .c3d, .bvh or .trc file; default: a random swarm");
  app.add_option("--markers", options.markers,
                 "number of markers, on as many people as needed; 0: the markers of the file, or a swarm of 40")
      ->check(cli::Range(std::size_t{0}, std::size_t{512}));
  app.add_option("--cameras", world.cameras)->check(cli::Range(2, 64))->capture_default_str();
  app.add_option("--rate", options.rate_hz, "sets per second; default: rate of the recording")
      ->check(cli::Range(1.0, 2000.0));
  app.add_option("--seconds", options.seconds, "duration, s; default: length of the recording")
      ->check(cli::Range(0.0, 36000.0));
  app.add_option("--noise-px", world.noise_px, "standard deviation of a blob centroid, each axis")
      ->check(cli::Range(0.01, 5.0))
      ->capture_default_str();
  app.add_option("--misses", world.misses, "share of the views without a blob")->check(cli::Range(0.0, 1.0));
  app.add_option("--false", world.false_blobs, "number of false blobs for each true blob")
      ->check(cli::Range(0.0, 10.0));
  app.add_option("--lost-frames", world.lost_frames, "share of the images that are lost")->check(cli::Range(0.0, 1.0));
  app.add_option("--jitter-us", world.jitter_us, "largest error of a camera's time stamps")
      ->check(cli::Range(0.0, 200.0));
  app.add_flag("--merge", world.merge, "join blobs that touch");
  app.add_choice("--visibility", world.visibility,
                 {{"perfect", simworld::Visibility::Perfect}, {"measured", simworld::Visibility::Measured}},
                 "perfect, or as measured on real recordings (63 % of the views)");
  app.add_option("--seeds", options.seeds, "number of simulated worlds, each with its own rig and noise")
      ->check(cli::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--first-seed", options.first_seed)->capture_default_str();
  app.add_flag("--list-faults", options.list_faults, "print the blobs of each ghost and each miss on standard error");
  app.add_flag("--json", options.json, "print one JSON object");
  app.footer(kPointsExamples);
}

void run_points_seed(const PointsOptions& options, const simworld::PointMotion& motion, int seed, PointsScore& score) {
  simworld::PointsWorld world(options.world, motion, options.first_seed + static_cast<std::uint64_t>(seed));
  MarkerPipeline pipeline(world.rig());
  PointsScorer scorer(world.rig(), options.world.noise_px, score);
  const double seconds = options.seconds.value_or(motion.length_s());
  const auto sets = static_cast<int>(seconds * options.world.rate_hz + 1e-6) + 1;
  const bool shows_progress = isatty(STDERR_FILENO) != 0;
  for (int set = 0; set < sets; ++set) {
    const simworld::SeenInstant& seen = world.next();
    if (shows_progress && set % 50 == 0)
      fmt::print(stderr, "\rseed {} of {}, set {} of {} ", seed + 1, options.seeds, set, sets);
    if (!pipeline.step(seen)) continue;
    scorer.add(seen, pipeline.matches(), pipeline.markers(), pipeline.predicted(), pipeline.tracked());
    if (!options.list_faults) continue;
    fmt::print(stderr, "{}{}", describe_ghosts(set, seen, pipeline, scorer),
               describe_misses(set, seen, pipeline, scorer));
  }
  if (shows_progress) fmt::print(stderr, "\r{:40}\r", "");
}

int evaluate_points(PointsOptions& options) {
  std::unique_ptr<simworld::PointMotion> motion;
  if (options.motion.empty()) {
    motion = simworld::make_swarm(options.markers == 0 ? 40 : options.markers, options.first_seed);
  } else {
    auto loaded = simworld::load_motion(options.motion, options.markers);
    if (!loaded) return fail(loaded.error());
    motion = std::move(*loaded);
  }
  options.world.rate_hz = options.rate_hz.value_or(motion->rate_hz());
  PointsScore score;
  for (int seed = 0; seed < options.seeds; ++seed) run_points_seed(options, *motion, seed, score);
  if (options.json) {
    fmt::print("{}\n", to_json(score, options.motion.empty() ? "swarm" : options.motion, options.world, options.seeds));
  } else {
    fmt::print("{}", to_text(score));
  }
  return 0;
}

}  // namespace

int run_points(int argc, const char* const* argv) {
  PointsOptions options;
  cli::App app("Scores 3D markers from simulated cameras.", "mocap-eval points");
  add_points_options(app, options);
  if (const auto exit = app.parse(argc, argv)) return *exit;
  return evaluate_points(options);
}

}  // namespace mocap::eval
