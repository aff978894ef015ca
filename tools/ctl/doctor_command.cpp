#include "ctl/doctor_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "base/exit_codes.h"
#include "calibration/diagnosis/diagnose_rig.h"
#include "cameras/aravis/aravis_discovery.h"
#include "cameras/aravis/aravis_settings.h"
#include "cameras/aravis/usb_bandwidth.h"
#include "cameras/v4l2/v4l2_discovery.h"
#include "cameras/v4l2/v4l2_settings.h"
#include "ctl/doctor.h"
#include "lib/cli/status_line.h"
#include "lib/rigcheck/recorded_spots.h"
#include "settings/daemon_settings.h"
#include "settings/rig/rig_file.h"
#include "take/recordings/blob_recording.h"

namespace mocap::ctl {
namespace {

using preflight::bad;

struct DoctorOptions {
  std::filesystem::path config;
  std::filesystem::path rig;
  std::filesystem::path blobs;
  bool json = false;
};

// The features that this configuration needs.
Demands demands_of(const settings::DaemonSettings& settings) {
  Demands demands{.gige = false, .usb3 = false, .v4l2 = false};
  for (const cameras::CameraSettings& camera : settings.cameras) {
    if (const auto* aravis = camera.driver.as<cameras::AravisSettings>()) {
      demands.gige = true;
      demands.usb3 = demands.usb3 || (aravis->address.empty() && aravis->mac.empty());
      demands.ptp = demands.ptp || aravis->ptp;
    }
    demands.v4l2 = demands.v4l2 || camera.driver.as<cameras::V4l2Settings>() != nullptr;
  }
  if (!settings.record.snapshots.empty()) {
    const auto folder = settings.record.snapshots.parent_path();
    demands.records_to = folder.empty() ? "." : folder;
  }
  demands.locked_memory = settings.pipeline.lock_memory;
  return demands;
}

std::string missing_words(const cameras::AravisSettings& camera, const std::vector<cameras::DiscoveredCamera>& all) {
  constexpr Duration kPatience = std::chrono::milliseconds(400);
  if (!camera.address.empty()) {
    if (cameras::gige_camera_answers(camera.address, kPatience)) return {};
    return fmt::format("no camera answers at {}; {}", camera.address, cameras::listed(all));
  }
  const bool there = std::any_of(all.begin(), all.end(), [&](const cameras::DiscoveredCamera& each) {
    return !camera.serial.empty() ? each.serial == camera.serial : camera.mac.empty() || each.mac == camera.mac;
  });
  return there ? "" : "is not found; " + cameras::listed(all);
}

void look_for_cameras(const settings::DaemonSettings& settings, std::vector<Finding>& findings) {
  std::vector<cameras::DiscoveredCamera> all;
  const bool any = std::any_of(
      settings.cameras.begin(), settings.cameras.end(),
      [](const cameras::CameraSettings& camera) { return camera.driver.as<cameras::AravisSettings>() != nullptr; });
  if (any) all = cameras::discover_cameras();
  for (const cameras::CameraSettings& camera : settings.cameras) {
    std::string missing;
    if (const auto* aravis = camera.driver.as<cameras::AravisSettings>()) {
      missing = missing_words(*aravis, all);
    } else if (const auto* v4l2 = camera.driver.as<cameras::V4l2Settings>()) {
      const auto node = cameras::find_video_node(*v4l2);
      if (!node) missing = node.error().message;
      if (node && !std::filesystem::exists(*node)) missing = node->string() + " is not there";
    }
    findings.push_back({"camera " + camera.name, missing.empty() ? Verdict::Good : Verdict::Bad,
                        missing.empty() ? "is there" : missing,
                        missing.empty() ? "" : "check power, cable and address; mocapctl cameras list"});
  }
}

void look_at_usb(const settings::DaemonSettings& settings, std::vector<Finding>& findings) {
  for (const cameras::UsbLoad& load : cameras::usb_loads(settings.cameras, settings.rig)) {
    findings.push_back({"bandwidth of " + load.bus, load.too_much() ? Verdict::Bad : Verdict::Good, load.text(),
                        load.too_much() ? "plug a camera into another controller or a faster port; or lower rate_hz, "
                                          "the region, or the bits of pixel_format"
                                        : ""});
  }
}

constexpr double kExaminedSeconds = 60.0;  // the last part of a recording, as of mocap-calibrate verify

// The cameras of the rig in the order of the recording; fails if the rig lacks one.
Result<Rig> rig_of_recording(const Rig& rig, const take::BlobRecording& recording) {
  Rig ordered;
  for (const take::RecordedCamera& camera : recording.cameras) {
    const auto found = std::ranges::find(rig, camera.name, &CameraModel::name);
    if (found == rig.end()) {
      return Error{ErrorCode::NotFound, fmt::format("camera '{}' of the recording is not in the rig; choose the rig of "
                                                    "the same cameras with --rig",
                                                    camera.name)};
    }
    ordered.push_back(*found);
  }
  return ordered;
}

std::vector<Finding> findings_of(const calibration::RigDiagnosis& diagnosis, const Rig& rig) {
  std::vector<Finding> findings;
  if (rig.size() < calibration::kMinDiagnosedCameras) {
    return {{"rig", Verdict::Warning,
             fmt::format("a rig of {} cameras cannot be judged; three cameras or more are needed", rig.size()), ""}};
  }
  for (const calibration::RigFinding& finding : diagnosis.findings)
    findings.push_back({"rig", Verdict::Bad, calibration::sentence_of(finding, rig), ""});
  for (const std::size_t camera : diagnosis.undetermined) {
    findings.push_back(
        {"rig", Verdict::Warning,
         fmt::format("{} shares too few moving markers with the others for a judgement", rig[camera].name),
         "record a person who walks through the whole volume"});
  }
  if (findings.empty()) findings.push_back({"rig", Verdict::Good, "the blobs of all cameras fit the rig", ""});
  return findings;
}

// Adds whether the recorded blobs of all cameras fit the rig.
Status look_at_rig(const DoctorOptions& options, const Rig& rig, std::vector<Finding>& findings) {
  auto recording = take::read_blob_recording(options.blobs);
  if (!recording) return recording.error();
  const auto ordered = rig_of_recording(rig, *recording);
  if (!ordered) return ordered.error();
  const auto last = rigcheck::last_of(rigcheck::spots_of(*recording), from_s(kExaminedSeconds));
  cli::StatusLine line;
  const auto show = [&line](const std::string& tested) { line.show("comparing blobs and rig: " + tested); };
  const auto diagnosis = calibration::diagnose_rig(*ordered, last, show);
  for (Finding& finding : findings_of(diagnosis, *ordered)) findings.push_back(std::move(finding));
  return {};
}

int run(const DoctorOptions& options) {
  std::vector<Finding> findings;
  Rig rig;
  if (options.config.empty()) {
    findings = examine_machine({});
  } else {
    const auto settings = settings::load_daemon_settings(options.config);
    if (!settings) {
      fmt::print(stderr, "{}\n", settings::to_text(settings.error()));
      return kExitConfig;
    }
    findings = examine_machine(demands_of(*settings));
    look_for_cameras(*settings, findings);
    look_at_usb(*settings, findings);
    rig = settings->rig;
  }
  if (!options.rig.empty()) {
    auto loaded = settings::load_rig(options.rig);
    if (!loaded) {
      fmt::print(stderr, "{}\n", settings::to_text(loaded.error()));
      return kExitConfig;
    }
    rig = *std::move(loaded);
  }
  if (!options.blobs.empty()) {
    if (const Status looked = look_at_rig(options, rig, findings); !looked) {
      fmt::print(stderr, "mocapctl: {}\n", looked.error().message);
      return kExitData;
    }
  }
  print(findings, options.json);
  return is_bad(findings) ? kExitUnavailable : kExitOk;
}

}  // namespace

void add_doctor_command(cli::App& app, std::function<int()>& chosen) {
  auto options = std::make_shared<DoctorOptions>();
  cli::App* const doctor =
      app.add_subcommand("doctor", "check whether this machine can receive cameras; exit code 69 if a finding is bad");
  doctor->examples(
      "  mocapctl doctor\n"
      "  mocapctl doctor --config my.toml --json\n"
      "  mocapctl doctor --config my.toml --blobs take.blobs");
  doctor->add_option("--config", options->config, "check only what this configuration needs, and search its cameras")
      ->check(cli::ExistingFile{});
  doctor
      ->add_option("--blobs", options->blobs,
                   "blob recording of moving markers; name the cameras that do not fit the rig, and why (exchanged, "
                   "turned, other lens, ...)")
      ->type_name("FILE")
      ->check(cli::ExistingFile{});
  doctor->add_option("--rig", options->rig, "rig file for --blobs; default: the configuration's")
      ->type_name("FILE")
      ->check(cli::ExistingFile{});
  doctor->add_flag("--json", options->json, "print a JSON array of findings");
  doctor->callback([options, &chosen] { chosen = [options] { return run(*options); }; });
}

}  // namespace mocap::ctl
