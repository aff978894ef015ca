#include "calibrate/verify_command.h"

#include <numbers>

#include "calibrate/mend_rig.h"
#include "calibrate/rig_output.h"

namespace mocap::calibrate {
namespace {

constexpr double kSeconds = 10.0;
// Of a recording, the last: how the cameras stand now.
constexpr double kRecordedSeconds = 60.0;

void tell(const MendedRig& mended, const Rig& before) {
  if (mended.moved) fmt::print("{}\n", words_of(*mended.moved, before));
  for (const MendedCamera& camera : mended.cameras) {
    fmt::print("camera {}: was turned by {:.3f} degrees and moved by {:.2f} mm\n", camera.name,
               camera.turned_rad * 180.0 / std::numbers::pi, 1e3 * camera.moved_m);
  }
  fmt::print("rig: {:.3f} px before, {:.3f} px after\n", mended.before_px, mended.after_px);
}

}  // namespace

void add_refine_command(cli::App& app, RefineOptions& options) {
  cli::App* refine =
      app.add_subcommand("refine", "move any markers: mend a rig that drifted, or of which a camera was bumped");
  add_take_options(*refine, options.verify.take);
  refine->add_option("--rig", options.verify.rig, "the rig; default: the configuration's")->type_name("FILE");
  refine->add_option("--out", options.out, "the rig file to write; default: the same")->type_name("FILE");
  refine
      ->add_option("--drift-px", options.verify.drift_px,
                   "a camera that is off by more is mended from the others first")
      ->check(cli::Range(0.05, 20.0))
      ->capture_default_str();
  refine
      ->add_option("--seconds", options.verify.take.seconds,
                   "of live cameras, default 10; or the last of a recording, default 60")
      ->check(cli::Range(1.0, 3600.0));
  refine->add_flag("--dry-run", options.dry_run, "say what it would do, write nothing");
  refine->add_option("--threads", options.threads)->check(cli::Range(1, 64))->capture_default_str();
}

int run_refine(const RefineOptions& options) {
  catch_end();
  TakeOptions take = options.verify.take;
  if (take.seconds <= 0.0) take.seconds = take.blobs.empty() ? kSeconds : kRecordedSeconds;
  const auto gathered = gather_blobs(take);
  if (!gathered) {
    say("{}", gathered.error().message);
    return gathered.error().exit;
  }
  const std::filesystem::path file = options.verify.rig.empty() ? gathered->rig_file : options.verify.rig;
  const auto rig = with_lenses(*gathered, file, {});
  if (!rig) {
    say("{}", rig.error().message);
    return rig.error().exit;
  }
  const auto mended =
      mend_rig(gathered->recording, *rig, {.drift_px = options.verify.drift_px, .threads = options.threads});
  if (!mended) {
    say("{}", mended.error().message);
    return mended.error().exit;
  }
  tell(*mended, *rig);
  if (options.dry_run) return kExitOk;
  return write_rig(options.out.empty() ? file : options.out, mended->rig, {{"refined_px", mended->after_px}}, "refine");
}

}  // namespace mocap::calibrate
