#include "calibrate/verify_command.h"

#include <numbers>
#include <string>
#include <utility>

#include "calibrate/repair_recording.h"
#include "calibrate/rig_output.h"
#include "settings/rig/rig_file.h"

namespace mocap::calibrate {
namespace {

void report(const RecordingRepair& repaired, const Rig& before) {
  if (repaired.bump) fmt::print("{}\n", describe(*repaired.bump, before));
  for (const calibration::RepairedCamera& camera : repaired.cameras) {
    fmt::print("camera {}: was rotated by {:.3f} degrees and moved by {:.2f} mm\n", camera.name,
               camera.rotated_rad * 180.0 / std::numbers::pi, 1e3 * camera.moved_m);
  }
  for (const calibration::KeptCamera& camera : repaired.kept) {
    fmt::print("camera {}: kept as it was: {}\n", camera.name, calibration::reason_of(camera));
  }
  fmt::print("rig: residual {:.3f} px before, {:.3f} px after\n", repaired.before_px, repaired.after_px);
}

int repair_and_write(const RefineOptions& options, const GatheredBlobs& gathered) {
  const std::filesystem::path file = options.verify.rig.empty() ? gathered.rig_file : options.verify.rig;
  const auto rig = rig_with_lenses(gathered, file, {});
  if (!rig) {
    print_message("{}", rig.error().message);
    return rig.error().exit;
  }
  const RigDeviations deviations = measure_deviations(gathered.recording, *rig, options.verify.drift_px);
  if (const auto diagnosis = diagnose(gathered.recording, *rig, deviations); !diagnosis.findings.empty()) {
    print_findings(diagnosis, *rig);
    return kExitData;
  }
  const auto repaired = repair_from_recording(gathered.recording, *rig,
                                              {.drift_px = options.verify.drift_px, .threads = options.threads});
  if (!repaired) {
    print_message("{}", repaired.error().message);
    return repaired.error().exit;
  }
  report(*repaired, *rig);
  if (!options.dry_run) {
    settings::RigMetadata facts{{"refined_px", repaired->after_px}};
    if (settings::floor_is_guessed(file)) facts["floor"] = std::string("guessed");
    const int written = write_rig(options.out.empty() ? file : options.out, with_absent_cameras(repaired->rig, file),
                                  std::move(facts), "refine");
    if (written != kExitOk) return written;
  }
  if (!repaired->kept.empty()) {
    std::fflush(stdout);
    print_message(
        "warning: {} of {} cameras could not be judged and are as they were; move markers through their images, where "
        "two other cameras see them, too",
        repaired->kept.size(), rig->size());
  }
  return kExitOk;
}

}  // namespace

void add_refine_command(cli::App& app, RefineOptions& options) {
  cli::App* refine = app.add_subcommand("refine", "repair a rig with moving markers: drift, or a bumped camera");
  add_recording_options(*refine, options.verify.take);
  refine->examples(
      "  mocap-calibrate refine --config my.toml\n"
      "  mocap-calibrate refine --blobs take.blobs --rig my.rig.toml --out new.rig.toml");
  refine->add_option("--rig", options.verify.rig, "rig file; default: the configuration's")->type_name("FILE");
  refine->add_option("--out", options.out, "rig file to write; default: the same")->type_name("FILE");
  refine
      ->add_option("--drift-px", options.verify.drift_px,
                   "a camera with a larger deviation is repaired from the others first")
      ->check(cli::Range(0.05, 20.0))
      ->capture_default_str();
  refine
      ->add_option("--seconds", options.verify.take.seconds,
                   "duration of live cameras, default 10; or the last part of a recording, default 60")
      ->check(cli::Range(1.0, 3600.0));
  refine->add_flag("--dry-run", options.dry_run, "report only, write nothing");
  refine->add_option("--threads", options.threads)->check(cli::Range(1, 64))->capture_default_str();
}

int run_refine(const RefineOptions& options) {
  if (!options.dry_run) {
    const auto output =
        check_rig_output(options.out.empty() ? options.verify.rig : options.out, options.verify.take.config);
    if (!output) {
      print_message("{}", output.error().message);
      return output.error().exit;
    }
  }
  catch_signals();
  RecordingOptions take = options.verify.take;
  if (take.seconds <= 0.0) take.seconds = take.blobs.empty() ? kLiveSeconds : kRecordedSeconds;
  return work_on_blobs(gather_blobs(take),
                       [&](const GatheredBlobs& gathered) { return repair_and_write(options, gathered); });
}

}  // namespace mocap::calibrate
