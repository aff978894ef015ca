#include "calibrate/verify_command.h"

#include <algorithm>
#include <numbers>

#include "calibrate/rig_deviations.h"
#include "calibration/image_cells.h"
#include "lib/rigcheck/recorded_spots.h"

namespace mocap::calibrate {
namespace {

bool fits(const calibration::RigDiagnosis& diagnosis, std::size_t camera) {
  return std::ranges::none_of(diagnosis.findings, [&](const calibration::RigFinding& finding) {
    const bool is_exchanged = finding.fault == calibration::RigFault::Exchanged && finding.other == camera;
    return finding.fault == calibration::RigFault::OtherRig || finding.camera == camera || is_exchanged;
  });
}

void report(const CameraModel& camera, const RigDeviations& deviations, std::size_t index, bool fits) {
  const drift::CameraDrift& drift = deviations.drifts[index];
  if (!fits) {
    fmt::print("camera {}: does not fit the rig\n", camera.name);
    return;
  }
  if (drift.views < kMinViews) {
    fmt::print("camera {}: undetermined; too few markers that this and three other cameras see\n", camera.name);
    return;
  }
  if (is_undetermined(deviations, index)) {
    fmt::print("camera {}: undetermined; its markers cover {} of {} parts of its image, expected at least {}\n",
               camera.name, deviations.covered_cells[index], calibration::CoveredCells{}.size(),
               calibration::kMinCoveredCells);
    return;
  }
  fmt::print(
      "camera {}: {} ({:.2f} px rms; {:.2f} px by a rotation of {:.3f} degrees and a translation of {:.1f} mm)\n",
      camera.name, drift.drifted ? "deviates from the rig" : "agrees with the rig", drift.rms_px, drift.off_px,
      drift.turned_rad * 180.0 / std::numbers::pi, 1e3 * drift.moved_m);
}

}  // namespace

std::string describe(const CameraBump& bump, const Rig& rig) {
  return fmt::format("camera {}: was moved within the first {:.1f} s of the recording; only the rest is used",
                     rig[bump.camera].name, bump.after_s);
}

calibration::RigDiagnosis diagnose(const take::BlobRecording& recording, const Rig& rig,
                                   const RigDeviations& deviations) {
  const take::BlobRecording used = deviations.bump ? since(recording, deviations.bump->at) : recording;
  const auto show = [](const std::string& tested) { show_progress("comparing blobs and rig: " + tested); };
  calibration::RigDiagnosis diagnosis = calibration::diagnose_rig(rig, rigcheck::spots_of(used), show);
  clear_progress();
  std::erase_if(diagnosis.findings, [&](const calibration::RigFinding& finding) {
    return finding.fault == calibration::RigFault::OtherPose && deviations.drifts[finding.camera].drifted;
  });
  return diagnosis;
}

void print_findings(const calibration::RigDiagnosis& diagnosis, const Rig& rig) {
  for (const calibration::RigFinding& finding : diagnosis.findings)
    print_message("{}", calibration::sentence_of(finding, rig));
}

void add_verify_command(cli::App& app, VerifyOptions& options) {
  cli::App* verify = app.add_subcommand("verify", "check with moving markers that every camera agrees with the rig");
  add_recording_options(*verify, options.take);
  verify->examples(
      "  mocap-calibrate verify --config my.toml\n"
      "  mocap-calibrate verify --blobs take.blobs --rig my.rig.toml --drift-px 0.5");
  verify->add_option("--rig", options.rig, "rig file; default: the configuration's")->type_name("FILE");
  verify
      ->add_option("--drift-px", options.drift_px,
                   "largest deviation of a camera that agrees with the rig: rms length of the residuals that another "
                   "pose explains; all px of the report are such lengths, not per axis")
      ->check(cli::Range(0.05, 20.0))
      ->capture_default_str();
  verify
      ->add_option("--seconds", options.take.seconds,
                   "duration of live cameras, default 10; or the last part of a recording, default 60")
      ->check(cli::Range(1.0, 3600.0));
}

namespace {

int judge(const VerifyOptions& options, const GatheredBlobs& gathered) {
  const auto rig = rig_with_lenses(gathered, options.rig.empty() ? gathered.rig_file : options.rig, {});
  if (!rig) {
    print_message("{}", rig.error().message);
    return rig.error().exit;
  }
  const RigDeviations deviations = measure_deviations(gathered.recording, *rig, options.drift_px);
  const std::vector<drift::CameraDrift>& drifts = deviations.drifts;
  if (deviations.bump) fmt::print("{}\n", describe(*deviations.bump, *rig));
  const calibration::RigDiagnosis diagnosis = diagnose(gathered.recording, *rig, deviations);
  for (std::size_t c = 0; c < rig->size(); ++c) report((*rig)[c], deviations, c, fits(diagnosis, c));
  std::fflush(stdout);
  print_findings(diagnosis, *rig);
  if (!diagnosis.findings.empty()) return kExitData;
  const auto deviating = std::ranges::count_if(drifts, &drift::CameraDrift::drifted);
  std::size_t undetermined = 0;
  for (std::size_t c = 0; c < rig->size(); ++c) undetermined += is_undetermined(deviations, c) ? 1 : 0;
  if (deviating > 0)
    print_message("{} of {} cameras deviate from the rig; repair the rig with mocap-calibrate refine", deviating,
                  rig->size());
  if (rig->size() < calibration::kMinDiagnosedCameras)
    print_message("a rig of {} cameras cannot be judged; three cameras or more are needed", rig->size());
  else if (undetermined > 0)
    print_message(
        "{} of {} cameras are undetermined; move markers through the whole volume, where four cameras see them",
        undetermined, rig->size());
  return deviating > 0 || undetermined > 0 ? kExitData : kExitOk;
}

}  // namespace

int run_verify(const VerifyOptions& options) {
  catch_signals();
  RecordingOptions take = options.take;
  if (take.seconds <= 0.0) take.seconds = take.blobs.empty() ? kLiveSeconds : kRecordedSeconds;
  return work_on_blobs(gather_blobs(take), [&](const GatheredBlobs& gathered) { return judge(options, gathered); });
}

}  // namespace mocap::calibrate
