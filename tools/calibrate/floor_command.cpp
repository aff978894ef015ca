#include "calibrate/floor_command.h"

#include <algorithm>
#include <string>
#include <utility>

#include "calibrate/marker_pipeline.h"
#include "calibrate/rig_output.h"
#include "calibration/floor/floor.h"
#include "calibration/floor/measure_floor.h"

namespace mocap::calibrate {
namespace {

constexpr double kLiveSeconds = 5.0;
constexpr double kWalkSeconds = 30.0;

int measure_and_write(const FloorOptions& options, const GatheredBlobs& gathered) {
  const std::filesystem::path file = options.rig.empty() ? gathered.rig_file : options.rig;
  const auto rig = rig_with_lenses(gathered, file, {});
  if (!rig) {
    print_message("{}", rig.error().message);
    return rig.error().exit;
  }
  const FloorOrder order = cli::floor_order(options.floor);
  const bool walks = order.method == FloorMethod::Walk;
  const std::vector<Eigen::Vector3d> points_m =
      walks ? walk_positions(gathered.recording, *rig) : stationary_markers(gathered.recording, *rig);
  const auto floor = calibration::measure_floor(order, points_m, *rig);
  if (!floor) {
    print_message("{}", floor.error().message);
    return kExitData;
  }
  const Rig placed = calibration::in_world(*floor, with_absent_cameras(*rig, file));
  double lowest = 1e9;
  double highest = -1e9;
  for (const CameraModel& camera : placed) {
    lowest = std::min(lowest, camera.centre().v.z());
    highest = std::max(highest, camera.centre().v.z());
  }
  const std::string residual = floor->is_checked ? fmt::format("residual {:.1f} mm", 1e3 * floor->rms_m)
                                                 : "not checked: three markers always fit; lay a fourth one";
  fmt::print("floor: {}; the cameras are {:.2f} to {:.2f} m above the floor\n", residual, lowest, highest);
  if (options.dry_run) return kExitOk;
  settings::RigMetadata facts{{"floor", std::string(calibration::name_of(order.method))}};
  if (floor->is_checked) facts["floor_rms_mm"] = 1e3 * floor->rms_m;
  return write_rig(options.out.empty() ? file : options.out, placed, std::move(facts), "floor");
}

}  // namespace

void add_floor_command(cli::App& app, FloorOptions& options) {
  cli::App* floor = app.add_subcommand("floor", "measure the floor with a floor frame, with markers, or with a walk");
  add_recording_options(*floor, options.take);
  floor->examples(
      "  mocap-calibrate floor --config my.toml --frame 600,400\n"
      "  mocap-calibrate floor --config my.toml --walk --height 40");
  floor->add_option("--rig", options.rig, "rig file; default: the configuration's")->type_name("FILE");
  floor->add_option("--out", options.out, "rig file to write; default: the same")->type_name("FILE");
  cli::add_floor_options(*floor, options.floor);
  floor
      ->add_option(
          "--seconds", options.take.seconds,
          "duration of live cameras, default 5, with --walk 30; or the last part of a recording, default all of it")
      ->check(cli::Range(1.0, 3600.0));
  floor->add_flag("--dry-run", options.dry_run, "report only, write nothing");
}

int run_floor(const FloorOptions& options) {
  if (options.rig.empty() && options.take.config.empty()) {
    print_message("set the rig with --rig FILE or --config FILE");
    return kExitUsage;
  }
  if (!options.dry_run) {
    const auto output = check_rig_output(options.out.empty() ? options.rig : options.out, options.take.config);
    if (!output) {
      print_message("{}", output.error().message);
      return output.error().exit;
    }
  }
  catch_signals();
  RecordingOptions take = options.take;
  if (take.seconds <= 0.0 && take.blobs.empty()) take.seconds = options.floor.by_walk ? kWalkSeconds : kLiveSeconds;
  return work_on_blobs(gather_blobs(take),
                       [&](const GatheredBlobs& gathered) { return measure_and_write(options, gathered); });
}

}  // namespace mocap::calibrate
