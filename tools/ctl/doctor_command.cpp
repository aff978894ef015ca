#include "ctl/doctor_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <variant>
#include <vector>

#include "base/exit_codes.h"
#include "cameras/aravis/aravis_discovery.h"
#include "cameras/aravis/aravis_settings.h"
#include "cameras/aravis/usb_bandwidth.h"
#include "cameras/v4l2/v4l2_discovery.h"
#include "cameras/v4l2/v4l2_settings.h"
#include "ctl/doctor.h"
#include "settings/daemon_settings.h"

namespace mocap::ctl {
namespace {

struct DoctorOptions {
  std::filesystem::path config;
  bool json = false;
};

constexpr const char* kWords[] = {"good", "warning", "bad"};  // by Verdict

// What this configuration needs, and not what any might.
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
    return fmt::format("nobody answers at {}; {}", camera.address, cameras::listed(all));
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

void print(const std::vector<Finding>& findings, bool json) {
  if (json) {
    nlohmann::json list = nlohmann::json::array();
    for (const Finding& each : findings) {
      list.push_back({{"check", each.check},
                      {"verdict", kWords[static_cast<std::size_t>(each.verdict)]},
                      {"what", each.what},
                      {"cure", each.cure}});
    }
    fmt::print("{}\n", list.dump());
    return;
  }
  for (const Finding& each : findings) {
    fmt::print("{:<8} {:<28} {}\n", kWords[static_cast<std::size_t>(each.verdict)], each.check, each.what);
    if (!each.cure.empty()) fmt::print("{:<8} {:<28} > {}\n", "", "", each.cure);
  }
}

int run(const DoctorOptions& options) {
  std::vector<Finding> findings;
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
  }
  print(findings, options.json);
  const bool bad =
      std::any_of(findings.begin(), findings.end(), [](const Finding& each) { return each.verdict == Verdict::Bad; });
  return bad ? kExitUnavailable : kExitOk;
}

}  // namespace

void add_doctor_command(cli::App& app, std::function<int()>& chosen) {
  auto options = std::make_shared<DoctorOptions>();
  cli::App* const doctor =
      app.add_subcommand("doctor", "looks whether this machine can receive cameras; 69 where something is bad");
  doctor->add_option("--config", options->config, "looks at what this configuration needs, and for its cameras")
      ->check(cli::ExistingFile{});
  doctor->add_flag("--json", options->json, "a JSON array of findings");
  doctor->callback([options, &chosen] { chosen = [options] { return run(*options); }; });
}

}  // namespace mocap::ctl
