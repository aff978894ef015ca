#include "calibrate/floor_command.h"

#include <algorithm>
#include <cmath>

#include "calibrate/marker_row.h"
#include "calibrate/rig_output.h"
#include "calibration/floor/floor.h"
#include "calibration/floor/frame_size.h"

namespace mocap::calibrate {
namespace {

constexpr double kSeconds = 5.0;
// Nearer to its size, a frame was refused for something else.
constexpr double kOtherSize = 0.02;
constexpr double kWalkSeconds = 30.0;

Result<calibration::Floor> find_floor(const FloorOptions& options, const take::BlobRecording& recording,
                                      const Rig& rig) {
  const double height_m = 1e-3 * options.height_mm;
  if (options.by_walk) return calibration::floor_by_walk(marker_places(recording, rig), height_m, rig);
  std::vector<Eigen::Vector3d> points;
  for (const StillMarker& marker : still_markers(recording, rig)) points.push_back(marker.at_m);
  if (options.by_markers) return calibration::floor_by_points(points, height_m, rig);
  const calibration::FloorFrame frame{1e-3 * options.frame_mm[0], 1e-3 * options.frame_mm[1], height_m};
  auto floor = calibration::floor_by_frame(points, frame, rig);
  if (floor) return floor;
  // A frame of the right shape and of another size: then the wand was not as long as was told.
  const auto times = calibration::frame_times_larger(points, frame);
  if (times && std::abs(*times - 1.0) > kOtherSize) {
    return Error{
        ErrorCode::InvalidArgument,
        fmt::format("a floor frame that is {:.3f} times as large as told ({:.0f}, {:.0f} mm): the wand was told "
                    "{} by as much, or these are another frame's arms; say them with --frame",
                    *times, options.frame_mm[0], options.frame_mm[1], *times > 1.0 ? "longer" : "shorter")};
  }
  return floor;
}

}  // namespace

void add_floor_command(cli::App& app, FloorOptions& options) {
  cli::App* floor = app.add_subcommand("floor", "lay a floor frame down: where the floor is, and the axes");
  add_take_options(*floor, options.take);
  floor->add_option("--rig", options.rig, "the rig whose world is laid on the floor; default: the configuration's")
      ->type_name("FILE");
  floor->add_option("--out", options.out, "the rig file to write; default: the same")->type_name("FILE");
  auto* frame = floor
                    ->add_option("--frame", options.frame_mm,
                                 "the frame's long arm (along x) and short arm (along y), mm; its corner is the origin")
                    ->delimiter(',')
                    ->expected(2)
                    ->check(cli::Range(50.0, 10000.0))
                    ->capture_default_str();
  auto* markers = floor
                      ->add_flag("--markers", options.by_markers,
                                 "three or more markers that lie on the floor, instead of a frame: they tell no axes")
                      ->excludes(frame);
  floor->add_flag("--walk", options.by_walk, "the lowest places of somebody's markers who walks about")
      ->excludes(frame)
      ->excludes(markers);
  floor->add_option("--height", options.height_mm, "of the (lowest) markers' centres over the floor, mm")
      ->check(cli::Range(-100.0, 1000.0))
      ->capture_default_str();
  floor->add_option("--seconds", options.take.seconds, "of live cameras; default 5, of a walk 30")
      ->check(cli::Range(1.0, 3600.0));
  floor->add_flag("--dry-run", options.dry_run, "say what it would do, write nothing");
}

int run_floor(const FloorOptions& options) {
  if (options.rig.empty() && options.take.config.empty()) {
    say("say whose floor it is with --rig FILE or --config FILE");
    return kExitUsage;
  }
  catch_end();
  TakeOptions take = options.take;
  if (take.seconds <= 0.0) take.seconds = options.by_walk ? kWalkSeconds : kSeconds;
  const auto gathered = gather_blobs(take);
  if (!gathered) {
    say("{}", gathered.error().message);
    return gathered.error().exit;
  }
  const std::filesystem::path file = options.rig.empty() ? gathered->rig_file : options.rig;
  const auto rig = with_lenses(*gathered, file, {});
  if (!rig) {
    say("{}", rig.error().message);
    return rig.error().exit;
  }
  const auto floor = find_floor(options, gathered->recording, *rig);
  if (!floor) {
    say("{}", floor.error().message);
    return kExitData;
  }
  const Rig laid = calibration::laid_on(*floor, *rig);
  double low = 1e9;
  double high = -1e9;
  for (const CameraModel& camera : laid) {
    low = std::min(low, camera.centre().v.z());
    high = std::max(high, camera.centre().v.z());
  }
  fmt::print("floor: fits to {:.1f} mm; the cameras hang {:.2f} to {:.2f} m over it\n", 1e3 * floor->rms_m, low, high);
  if (options.dry_run) return kExitOk;
  const char* how = options.by_walk ? "walk" : options.by_markers ? "markers" : "frame";
  return write_rig(options.out.empty() ? file : options.out, laid,
                   {{"floor", std::string(how)}, {"floor_rms_mm", 1e3 * floor->rms_m}}, "floor");
}

}  // namespace mocap::calibrate
