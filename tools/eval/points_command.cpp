#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "eval/command.h"
#include "eval/points_ghosts.h"
#include "eval/points_row.h"
#include "eval/points_score.h"
#include "lib/cli/app.h"
#include "lib/simworld/points_motion.h"
#include "lib/simworld/points_world.h"

namespace mocap::eval {
namespace {

constexpr int kBadData = 65;  // sysexits EX_DATAERR
constexpr int kNoInput = 66;  // sysexits EX_NOINPUT

constexpr const char* kExamples =
    "Simulated cameras look at markers that move as in a recording; the blobs go through the daemon's own stages "
    "(align,\n"
    "match, triangulate, track), and what comes out is compared with the truth.\n"
    "\n"
    "rms_mm is the error of triangulated points, bound_mm what the true rays and the noise allow at best. nees is the\n"
    "squared error in units of the covariance that was told: nees_expected (3) where it tells the truth. recall_3plus "
    "and\n"
    "recall_2 (of markers that a track foretold) count triangulated points by the cameras that have a blob of the\n"
    "marker alone. ghosts are confirmed tracks where nothing is. id_changes: a marker bears another track than "
    "before.\n"
    "\n"
    "  mocap-eval points --markers 80 --false 0.1 --seeds 3\n"
    "  mocap-eval points --motion walk.c3d --cameras 8 --rate 25 --noise-px 0.1 --json\n"
    "  mocap-eval points --motion dance.bvh --visibility measured --merge --misses 0.01 --seconds 5\n";

struct Options {
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
  return error.code == ErrorCode::InvalidArgument ? kBadData : kNoInput;
}

void add_options(cli::App& app, Options& options) {
  simworld::WorldSettings& world = options.world;
  app.add_option("--motion", options.motion, "a .c3d, .bvh or .trc file; without one, markers that wander about");
  app.add_option("--markers", options.markers,
                 "how many, worn by as many people as it takes; 0: those of the file, or 40 that wander")
      ->check(cli::Range(std::size_t{0}, std::size_t{512}));
  app.add_option("--cameras", world.cameras)->check(cli::Range(2, 64))->capture_default_str();
  app.add_option("--rate", options.rate_hz, "sets a second; without it the recording's own")
      ->check(cli::Range(1.0, 2000.0));
  app.add_option("--seconds", options.seconds, "how long; without it, the length of the recording")
      ->check(cli::Range(0.0, 36000.0));
  app.add_option("--noise-px", world.noise_px, "standard deviation of a blob's place, each axis")
      ->check(cli::Range(0.01, 5.0))
      ->capture_default_str();
  app.add_option("--misses", world.misses, "share of the views that give no blob")->check(cli::Range(0.0, 1.0));
  app.add_option("--false", world.false_blobs, "false blobs for each true one")->check(cli::Range(0.0, 10.0));
  app.add_option("--lost-frames", world.lost_frames, "share of images that never come")->check(cli::Range(0.0, 1.0));
  app.add_option("--jitter-us", world.jitter_us, "error of the cameras' time stamps, either way, at most")
      ->check(cli::Range(0.0, 200.0));
  app.add_flag("--merge", world.merge, "blobs that touch become one");
  app.add_choice("--visibility", world.visibility,
                 {{"perfect", simworld::Visibility::Perfect}, {"measured", simworld::Visibility::Measured}},
                 "perfect, or as measured on real recordings (63 % of the views)");
  app.add_option("--seeds", options.seeds, "worlds to try, each with its own rig and noise")
      ->check(cli::Range(1, 1000))
      ->capture_default_str();
  app.add_option("--first-seed", options.first_seed)->capture_default_str();
  app.add_flag("--list-faults", options.list_faults,
               "print what each ghost and each miss was made of, on standard error");
  app.add_flag("--json", options.json, "print one JSON object");
  app.footer(kExamples);
}

void run_seed(const Options& options, const simworld::PointMotion& motion, int seed, PointsScore& score) {
  simworld::PointsWorld world(options.world, motion, options.first_seed + static_cast<std::uint64_t>(seed));
  PointsRow row(world.rig());
  PointsScorer scorer(world.rig(), options.world.noise_px, score);
  const double seconds = options.seconds.value_or(motion.length_s());
  const auto sets = static_cast<int>(seconds * options.world.rate_hz + 1e-6) + 1;
  const bool tell = isatty(STDERR_FILENO) != 0;
  for (int set = 0; set < sets; ++set) {
    const simworld::SeenInstant& seen = world.next();
    if (tell && set % 50 == 0) fmt::print(stderr, "\rseed {} of {}, set {} of {} ", seed + 1, options.seeds, set, sets);
    if (!row.step(seen)) continue;
    scorer.add(seen, row.matches(), row.markers(), row.expected(), row.tracked());
    if (!options.list_faults) continue;
    fmt::print(stderr, "{}{}", describe_ghosts(set, seen, row, scorer), describe_misses(set, seen, row, scorer));
  }
  if (tell) fmt::print(stderr, "\r{:40}\r", "");
}

int run(Options& options) {
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
  for (int seed = 0; seed < options.seeds; ++seed) run_seed(options, *motion, seed, score);
  if (options.json) {
    fmt::print("{}\n", to_json(score, options.motion.empty() ? "swarm" : options.motion, options.world, options.seeds));
  } else {
    fmt::print("{}", to_text(score));
  }
  return 0;
}

}  // namespace

int run_points(int argc, const char* const* argv) {
  Options options;
  cli::App app("How well are markers found in space?", "mocap-eval points");
  add_options(app, options);
  if (const auto exit = app.parse(argc, argv)) return *exit;
  return run(options);
}

}  // namespace mocap::eval
