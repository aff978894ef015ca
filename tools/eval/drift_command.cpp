#include <fmt/core.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "assemble.h"
#include "base/exit_codes.h"
#include "calibrate/repair_recording.h"
#include "eval/command.h"
#include "lib/cli/app.h"
#include "lib/simworld/drift_world.h"
#include "synchronise/frame_aligner.h"

namespace mocap::eval {
namespace {

constexpr const char* kDriftHelp =
    "People move in front of simulated cameras. At --at seconds one camera is rotated and moved in random\n"
    "directions. The daemon's own pipeline (align, match, triangulate, track, label, solve, watch) continues.\n"
    "named_s: time from then until the drift watch reports the camera. false_alarms: reports of other cameras,\n"
    "or of this camera before. --after seconds later the rig is repaired as by mocap-calibrate refine, from the\n"
    "last seconds of the take. position_error_mm and rotation_error_deg are the errors of the moved camera\n"
    "after the repair, worst_mm is the largest position error of all cameras, without alignment. --deg 0 --mm 0\n"
    "measures only false alarms.\n"
    "\n"
    "examples:\n"
    "  mocap-eval drift config/scenes/walk_about.toml --seeds 5\n"
    "  mocap-eval drift config/scenes/walk_about.toml --deg 0 --mm 0 --after 300 --json\n";

struct DriftOptions {
  std::string scene;
  simworld::Bump bump;
  double after_s = 12.0;
  double drift_px = 1.0;
  double refine_s = 10.0;
  std::uint64_t first_seed = 1;
  int seeds = 1;
  bool json = false;
};

struct Outcome {
  std::string camera;
  double named_s = -1.0;  // time since the bump; negative: never reported
  int false_alarms = 0;
  double off_px = 0.0;                      // largest reported offset of a camera that did not move
  double turned_deg = 0.0, moved_mm = 0.0;  // estimate of the drift watch at the end
  bool refined = false;
  std::string why_not;
  double position_error_mm = 0.0, rotation_error_deg = 0.0, worst_mm = 0.0;
};

// The daemon's pipeline from blobs to snapshots, with its drift watch.
class WatchedPipeline {
 public:
  WatchedPipeline(const settings::DaemonSettings& settings)
      : align_(settings.pipeline.align), aligner_(align_, settings.rig.size()), fusion_(assemble_fusion(settings)) {}

  const drift::CameraDrift& step(const std::vector<BlobFrame>& frames) {
    for (const BlobFrame& frame : frames) aligner_.add(frame);
    const auto set = aligner_.take(frames.front().exposed_at + align_.window + align_.patience);
    MOCAP_EXPECTS(set.has_value());
    static_cast<void>(fusion_->step(*set));
    return *fusion_->drift();
  }
  std::uint32_t assessed() const { return fusion_->assessed().value; }

 private:
  synchronise::AlignSettings align_;
  synchronise::FrameAligner aligner_;
  std::unique_ptr<fusion::Fusion> fusion_;
};

void keep(const std::vector<BlobFrame>& frames, take::BlobRecording& take) {
  for (std::size_t c = 0; c < frames.size(); ++c) {
    const BlobFrame& frame = frames[c];
    take.pictures[c].push_back({frame.number, frame.exposed_at, {frame.blobs.begin(), frame.blobs.end()}});
  }
}

double degrees_between(const CameraModel& a, const CameraModel& b) {
  const Eigen::AngleAxisd off(Eigen::Matrix3d(a.camera_from_world.rotation * b.camera_from_world.rotation.transpose()));
  return std::abs(off.angle()) * 180.0 / std::numbers::pi;
}

void repair(const take::BlobRecording& take, const simworld::DriftWorld& world, const DriftOptions& options,
            Outcome& outcome) {
  const auto repaired = calibrate::repair_from_recording(calibrate::last_of(take, options.refine_s), world.rig(),
                                                         {.drift_px = options.drift_px, .threads = 2});
  if (!repaired) {
    outcome.why_not = repaired.error().message;
    return;
  }
  outcome.refined = true;
  for (std::uint32_t c = 0; c < world.truth().size(); ++c) {
    const double off_mm = 1e3 * (repaired->rig[c].centre().v - world.truth()[c].centre().v).norm();
    outcome.worst_mm = std::max(outcome.worst_mm, off_mm);
    if (c != world.camera()) continue;
    outcome.position_error_mm = off_mm;
    outcome.rotation_error_deg = degrees_between(repaired->rig[c], world.truth()[c]);
  }
}

Result<Outcome> run_drift_seed(const simworld::SceneFile& scene, const DriftOptions& options, std::uint64_t seed) {
  const bool bumps = options.bump.turn_deg > 0.0 || options.bump.move_mm > 0.0;
  auto world = simworld::DriftWorld::make(scene, options.bump, seed);
  if (!world) return world.error();
  settings::DaemonSettings daemon = scene.daemon;
  daemon.rig = world->rig();
  daemon.subject_models = world->subjects();
  daemon.drift.drift_px = options.drift_px;
  WatchedPipeline row(daemon);
  take::BlobRecording take;
  take.pictures.resize(world->rig().size());
  for (const CameraModel& camera : world->rig())
    take.cameras.push_back({camera.name, camera.width_px, camera.height_px});
  Outcome outcome;
  outcome.camera = world->rig()[world->camera()].name;
  std::vector<bool> named(world->rig().size(), false);
  const auto sets = static_cast<std::int64_t>((options.bump.at_s + options.after_s) * scene.rate_hz);
  for (std::int64_t set = 0; set < sets; ++set) {
    world->step();
    const drift::CameraDrift& drift = row.step(world->frames());
    if (bumps && world->bumped()) keep(world->frames(), take);
    const std::uint32_t c = row.assessed();
    const bool is_it = bumps && c == world->camera() && world->bumped();
    if (!is_it && drift.views > 100.0) outcome.off_px = std::max(outcome.off_px, drift.off_px);
    if (is_it) outcome.turned_deg = drift.turned_rad * 180.0 / std::numbers::pi, outcome.moved_mm = 1e3 * drift.moved_m;
    if (drift.drifted && !named[c]) {
      if (is_it) outcome.named_s = world->t_s() - options.bump.at_s;
      if (!is_it) ++outcome.false_alarms;
    }
    named[c] = drift.drifted;
  }
  if (bumps) repair(take, *world, options, outcome);
  return outcome;
}

void print_text(std::uint64_t seed, const Outcome& outcome) {
  fmt::print(
      "seed {}: {} named after {:.1f} s (turned {:.2f} degrees, moved {:.1f} mm), false alarms {}, others off {:.2f} "
      "px at most",
      seed, outcome.camera, outcome.named_s, outcome.turned_deg, outcome.moved_mm, outcome.false_alarms,
      outcome.off_px);
  if (outcome.refined) {
    fmt::print("; refined to {:.2f} mm, {:.4f} degrees, all within {:.2f} mm", outcome.position_error_mm,
               outcome.rotation_error_deg, outcome.worst_mm);
  }
  fmt::print("{}{}\n", outcome.why_not.empty() ? "" : "; not refined: ", outcome.why_not);
}

void print_json(const std::vector<Outcome>& all) {
  double slowest = 0.0, position = 0.0, rotation = 0.0, worst = 0.0, off = 0.0;
  int named = 0, false_alarms = 0, refined = 0;
  for (const Outcome& one : all) {
    named += one.named_s >= 0.0 ? 1 : 0;
    refined += one.refined ? 1 : 0;
    false_alarms += one.false_alarms;
    slowest = std::max(slowest, one.named_s);
    position = std::max(position, one.position_error_mm);
    rotation = std::max(rotation, one.rotation_error_deg);
    worst = std::max(worst, one.worst_mm);
    off = std::max(off, one.off_px);
  }
  fmt::print(
      "{{\"seeds\": {}, \"named\": {}, \"slowest_named_s\": {:.2f}, \"false_alarms\": {}, \"others_off_px\": "
      "{:.3f}, \"refined\": {}, \"position_error_mm\": {:.3f}, \"rotation_error_deg\": {:.5f}, \"worst_mm\": "
      "{:.3f}}}\n",
      all.size(), named, slowest, false_alarms, off, refined, position, rotation, worst);
}

int evaluate_drift(const DriftOptions& options) {
  const auto scene = simworld::load_scene(options.scene);
  if (!scene) {
    fmt::print(stderr, "{}\n", settings::to_text(scene.error()));
    return kExitData;
  }
  std::vector<Outcome> all;
  for (int i = 0; i < options.seeds; ++i) {
    const std::uint64_t seed = options.first_seed + static_cast<std::uint64_t>(i);
    if (isatty(STDERR_FILENO) != 0) fmt::print(stderr, "\rseed {} ", seed);
    auto outcome = run_drift_seed(*scene, options, seed);
    if (!outcome) {
      fmt::print(stderr, "mocap-eval: {}\n", outcome.error().message);
      return kExitData;
    }
    if (!options.json) print_text(seed, *outcome);
    all.push_back(*std::move(outcome));
  }
  if (options.json) print_json(all);
  return 0;
}

}  // namespace

int run_drift(int argc, const char* const* argv) {
  DriftOptions options;
  cli::App app("Scores the detection and repair of a moved camera.", "mocap-eval drift");
  app.add_option("scene", options.scene, "scene file, as in config/scenes")->required();
  app.add_option("--deg", options.bump.turn_deg, "rotation of the camera, degrees")
      ->check(cli::Range(0.0, 5.0))
      ->capture_default_str();
  app.add_option("--mm", options.bump.move_mm, "displacement of the camera, mm")
      ->check(cli::Range(0.0, 200.0))
      ->capture_default_str();
  app.add_option("--at", options.bump.at_s, "time of the bump, s")
      ->check(cli::Range(0.0, 3600.0))
      ->capture_default_str();
  app.add_option("--after", options.after_s, "duration after the bump, s")
      ->check(cli::Range(0.1, 36000.0))
      ->capture_default_str();
  app.add_option("--drift-px", options.drift_px, "value of [watch] drift_px")
      ->check(cli::Range(0.05, 20.0))
      ->capture_default_str();
  app.add_option("--refine-seconds", options.refine_s,
                 "duration at the end of the take from which the rig is repaired, s")
      ->check(cli::Range(1.0, 3600.0))
      ->capture_default_str();
  app.add_option("--seeds", options.seeds)->check(cli::Range(1, 1000))->capture_default_str();
  app.add_option("--first-seed", options.first_seed)->capture_default_str();
  app.add_flag("--json", options.json, "print one JSON object with the worst figures over all seeds");
  app.footer(kDriftHelp);
  if (const auto exit = app.parse(argc, argv)) return *exit;
  return evaluate_drift(options);
}

}  // namespace mocap::eval
