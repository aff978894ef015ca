#include "calibrate/verify_command.h"

#include <algorithm>
#include <numbers>

#include "calibrate/standing.h"

namespace mocap::calibrate {
namespace {

constexpr double kSeconds = 10.0;
// Of a recording, the last: how the cameras stand now.
constexpr double kRecordedSeconds = 60.0;
// Of markers in views, weighted: fewer do not tell how a camera stands.
constexpr double kLeastViews = 100.0;

void tell(const CameraModel& camera, const drift::CameraDrift& drift) {
  if (drift.views < kLeastViews) {
    fmt::print("camera {}: not told; too few markers that it and three others see\n", camera.name);
    return;
  }
  fmt::print("camera {}: {} ({:.2f} px rms; {:.2f} px by a turn of {:.3f} degrees and a move of {:.1f} mm)\n",
             camera.name, drift.drifted ? "stands otherwise than the rig says" : "as the rig says", drift.rms_px,
             drift.off_px, drift.turned_rad * 180.0 / std::numbers::pi, 1e3 * drift.moved_m);
}

}  // namespace

std::string words_of(const MovedMeanwhile& moved, const Rig& rig) {
  return fmt::format("camera {}: was moved within the first {:.1f} s of the take; only what came after counts",
                     rig[moved.camera].name, moved.after_s);
}

void add_verify_command(cli::App& app, VerifyOptions& options) {
  cli::App* verify = app.add_subcommand("verify", "move any markers: does every camera stand as the rig says?");
  add_take_options(*verify, options.take);
  verify->add_option("--rig", options.rig, "the rig; default: the configuration's")->type_name("FILE");
  verify->add_option("--drift-px", options.drift_px, "a camera may be off by so much on the whole")
      ->check(cli::Range(0.05, 20.0))
      ->capture_default_str();
  verify
      ->add_option("--seconds", options.take.seconds,
                   "of live cameras, default 10; or the last of a recording, default 60")
      ->check(cli::Range(1.0, 3600.0));
}

int run_verify(const VerifyOptions& options) {
  catch_end();
  TakeOptions take = options.take;
  if (take.seconds <= 0.0) take.seconds = take.blobs.empty() ? kSeconds : kRecordedSeconds;
  const auto gathered = gather_blobs(take);
  if (!gathered) {
    say("{}", gathered.error().message);
    return gathered.error().exit;
  }
  const auto rig = with_lenses(*gathered, options.rig.empty() ? gathered->rig_file : options.rig, {});
  if (!rig) {
    say("{}", rig.error().message);
    return rig.error().exit;
  }
  const Standing standing = standing_of(gathered->recording, *rig, options.drift_px);
  const std::vector<drift::CameraDrift>& drifts = standing.drifts;
  if (standing.moved) fmt::print("{}\n", words_of(*standing.moved, *rig));
  for (std::size_t c = 0; c < rig->size(); ++c) tell((*rig)[c], drifts[c]);
  std::fflush(stdout);
  const auto wrong = std::ranges::count_if(drifts, &drift::CameraDrift::drifted);
  const auto untold = std::ranges::count_if(drifts, [](const auto& drift) { return drift.views < kLeastViews; });
  if (wrong > 0) say("{} of {} cameras stand otherwise; mend the rig with mocap-calibrate refine", wrong, rig->size());
  if (untold > 0) say("{} of {} cameras are not told of; move markers where four cameras look", untold, rig->size());
  return wrong > 0 || untold > 0 ? kExitData : kExitOk;
}

}  // namespace mocap::calibrate
