#include "ctl/cameras_command.h"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "base/exit_codes.h"
#include "base/log.h"
#include "cameras/aravis/aravis_describe.h"
#include "cameras/aravis/aravis_discovery.h"
#include "cameras/aravis/aravis_settings.h"
#include "cameras/aravis/usb_bandwidth.h"
#include "cameras/open_camera.h"
#include "cameras/v4l2/v4l2_discovery.h"
#include "ctl/shot.h"
#include "detect/blob_detector.h"
#include "settings/daemon_settings.h"

namespace mocap::ctl {
namespace {

constexpr Duration kImagePatience = std::chrono::seconds(10);

struct CamerasOptions {
  std::string camera;
  std::filesystem::path config;
  std::filesystem::path out = "shot.png";
  std::filesystem::path sys = "/sys";
  bool json = false;
};

int fail(const Error& error) {
  fmt::print(stderr, "mocapctl: {}\n", error.message);
  return error.code == ErrorCode::InvalidArgument ? kExitConfig : kExitUnavailable;
}

void print_as_json(const std::vector<cameras::DiscoveredCamera>& aravis, const std::vector<cameras::VideoNode>& nodes,
                   const std::vector<std::string>& usb) {
  nlohmann::json list = nlohmann::json::array();
  for (const auto& each : aravis) {
    list.push_back({{"driver", "aravis"},
                    {"bus", each.bus},
                    {"serial", each.serial},
                    {"address", each.address},
                    {"mac", each.mac},
                    {"vendor", each.vendor},
                    {"model", each.model}});
  }
  for (const auto& each : nodes) {
    list.push_back({{"driver", "v4l2"},
                    {"device", each.device.string()},
                    {"bus", each.bus},
                    {"serial", each.serial},
                    {"model", each.card}});
  }
  for (const std::string& each : usb) list.push_back({{"usb", each}});
  fmt::print("{}\n", list.dump());
}

// What the cameras on each bus share; with a configuration, what they ask of it too.
Result<std::vector<std::string>> usb_lines(const CamerasOptions& options) {
  if (options.config.empty()) return cameras::usb_buses_of_cameras(options.sys);
  const auto settings = settings::load_daemon_settings(options.config);
  if (!settings) return Error{ErrorCode::InvalidArgument, settings::to_text(settings.error())};
  std::vector<std::string> lines;
  for (const auto& load : cameras::usb_loads(settings->cameras, settings->rig, options.sys)) {
    lines.push_back(load.text() + (load.too_much() ? "; too much" : ""));
  }
  return lines;
}

int run_list(const CamerasOptions& options) {
  const auto usb = usb_lines(options);
  if (!usb) return fail(usb.error());
  const auto aravis = cameras::discover_cameras();
  const auto nodes = cameras::list_video_nodes();
  if (options.json) {
    print_as_json(aravis, nodes, *usb);
    return kExitOk;
  }
  if (aravis.empty() && nodes.empty()) fmt::print("no camera answers; mocapctl doctor looks why\n");
  for (const auto& each : aravis) {
    fmt::print("aravis  {:<12} serial {:<16} address {:<16} mac {:<18} {} {}\n", each.bus, each.serial, each.address,
               each.mac, each.vendor, each.model);
  }
  for (const auto& each : nodes) {
    fmt::print("v4l2    {:<12} serial {:<16} bus {} {}\n", each.device.string(),
               each.serial.empty() ? "-" : each.serial, each.bus, each.card);
  }
  for (const std::string& each : *usb) fmt::print("usb     {}\n", each);
  return kExitOk;
}

// The camera that the configuration has under this name; else an address, a MAC or a serial number.
Result<cameras::AravisSettings> camera_named(const CamerasOptions& options) {
  cameras::AravisSettings camera;
  if (!options.config.empty()) {
    const auto settings = settings::load_daemon_settings(options.config);
    if (!settings) return Error{ErrorCode::InvalidArgument, settings::to_text(settings.error())};
    for (const auto& each : settings->cameras) {
      const auto* found = each.driver.as<cameras::AravisSettings>();
      if (found != nullptr && each.name == options.camera) return *found;
    }
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("{} has no aravis camera '{}'", options.config.string(), options.camera)};
  }
  in_addr address{};
  const bool is_address = inet_pton(AF_INET, options.camera.c_str(), &address) == 1;
  const bool is_mac = std::count(options.camera.begin(), options.camera.end(), ':') == 5;
  (is_address ? camera.address : is_mac ? camera.mac : camera.serial) = options.camera;
  camera.packet_socket = false;
  return camera;
}

int run_describe(const CamerasOptions& options) {
  const auto camera = camera_named(options);
  if (!camera) return fail(camera.error());
  const auto features = cameras::describe_aravis_camera(*camera);
  if (!features) return fail(features.error());
  if (options.json) {
    nlohmann::json list = nlohmann::json::array();
    for (const auto& each : *features) {
      list.push_back({{"category", each.category},
                      {"name", each.name},
                      {"kind", each.kind},
                      {"value", each.value},
                      {"range", each.range},
                      {"settable", each.settable}});
    }
    fmt::print("{}\n", list.dump());
    return kExitOk;
  }
  std::string category;
  for (const auto& each : *features) {
    if (each.category != category) fmt::print("\n[{}]\n", category = each.category);
    fmt::print("{:<28} {:<12} {:<2} {:<20} {}\n", each.name, each.kind, each.settable ? "rw" : "r", each.value,
               each.range);
  }
  return kExitOk;
}

// The first whole image; a camera that is still looked for is asked again.
Result<Frame> first_image(Camera& camera) {
  const Timestamp end = host_now() + kImagePatience;
  Status begun = camera.start();
  while (!begun && begun.error().code == ErrorCode::Timeout && host_now() < end) begun = camera.start();
  if (!begun) return begun.error();
  std::string broken;
  while (host_now() < end) {
    Result<Frame> frame = camera.next(std::chrono::milliseconds(100));
    if (frame) return frame;
    if (frame.error().code != ErrorCode::Timeout && frame.error().code != ErrorCode::Io) return frame.error();
    if (!frame.error().message.empty()) broken = frame.error().message;
  }
  return Error{ErrorCode::Timeout, broken.empty() ? "it is open, and no image came for 10 s; is it triggered" : broken};
}

int run_shot(const CamerasOptions& options) {
  const auto settings = settings::load_daemon_settings(options.config);
  if (!settings) {
    fmt::print(stderr, "{}\n", settings::to_text(settings.error()));
    return kExitConfig;
  }
  const auto found = std::find_if(settings->cameras.begin(), settings->cameras.end(),
                                  [&](const auto& each) { return each.name == options.camera; });
  if (found == settings->cameras.end()) {
    return fail(
        {ErrorCode::InvalidArgument, fmt::format("{} has no camera '{}'", options.config.string(), options.camera)});
  }
  const CameraId id{static_cast<std::uint32_t>(found - settings->cameras.begin())};
  const auto camera = cameras::open_camera(
      id, *found, {.rig = &settings->rig, .marker_set = &settings->simulated[id.value], .counters = nullptr});
  if (!camera) return fail(camera.error());
  const auto frame = first_image(**camera);
  if (!frame) return fail(frame.error());
  const Image& image = frame->image;
  const auto detector = detect::make_blob_detector(settings::detect_of(*settings, id), image.format, image.width_px,
                                                   image.height_px, settings->rig[id.value].masks);
  if (!detector) return fail(detector.error());
  const Detection detection = (*detector)->detect(image);
  if (const Status saved = save_shot(options.out, image, detection.blobs); !saved) return fail(saved.error());
  fmt::print("{}: {}x{}, {} blobs, threshold {:.0f} grey\n", options.out.string(), image.width_px, image.height_px,
             detection.blobs.size(), detection.threshold_grey);
  return kExitOk;
}

}  // namespace

void add_cameras_command(cli::App& app, std::function<int()>& chosen) {
  auto options = std::make_shared<CamerasOptions>();
  cli::App* const command = app.add_subcommand("cameras", "the cameras that answer, what they can do, what they see");
  command->require_subcommand(1);
  const auto add = [&](const char* name, const char* about, int (*run)(const CamerasOptions&)) {
    cli::App* const sub = command->add_subcommand(name, about);
    sub->callback([options, run, &chosen] {
      chosen = [options, run] {
        set_log_level(LogLevel::Warn);
        return run(*options);
      };
    });
    return sub;
  };
  cli::App* const list = add("list", "all cameras on the network, the USB and in the kernel", run_list);
  list->add_flag("--json", options->json, "a JSON array");
  list->add_option("--config", options->config, "also what its cameras ask of each USB bus")
      ->check(cli::ExistingFile{});
  list->add_option("--sys", options->sys, "where the kernel tells what is plugged in")->capture_default_str();
  cli::App* const describe = add("describe", "each feature of a camera, its value and its range", run_describe);
  describe->add_option("camera", options->camera, "an address, a serial number or a MAC; with --config, a name")
      ->required();
  describe->add_option("--config", options->config, "whose camera it is")->check(cli::ExistingFile{});
  describe->add_flag("--json", options->json, "a JSON array");
  cli::App* const shot = add("shot", "one image with its blobs drawn in", run_shot);
  shot->add_option("camera", options->camera, "its name in the configuration")->required();
  shot->add_option("--config", options->config, "the daemon's")->required()->check(cli::ExistingFile{});
  shot->add_option("--out", options->out, "a PNG")->capture_default_str();
}

}  // namespace mocap::ctl
