#include "ctl/camera/cameras_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/exit_codes.h"
#include "base/log.h"
#include "cameras/aravis/usb_bandwidth.h"
#include "cameras/camera_make.h"
#include "cameras/open_camera.h"
#include "ctl/camera/shot.h"
#include "ctl/json_line.h"
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

int fail_cameras(const Error& error) {
  fmt::print(stderr, "mocapctl: {}\n", error.message);
  return error.code == ErrorCode::InvalidArgument ? kExitConfig : kExitUnavailable;
}

// The bandwidth of each USB bus that has cameras; with a configuration, also the bandwidth that its cameras need.
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

std::string shown(const std::string& value) { return value.empty() ? "-" : value; }

// One line for each camera: "driver property value property value", with values aligned over the cameras of the make.
std::string lines_of(std::string_view driver, const std::vector<KeyPairs>& found) {
  const auto width_of = [&](std::size_t column) {
    std::size_t width = 0;
    for (const KeyPairs& camera : found) {
      if (column < camera.size()) width = std::max(width, shown(camera[column].second).size());
    }
    return width;
  };
  std::string text;
  for (const KeyPairs& camera : found) {
    text += fmt::format("{:<7}", driver);
    for (std::size_t column = 0; column < camera.size(); ++column) {
      const auto& [property, value] = camera[column];
      const bool last = column + 1 == camera.size();
      text += fmt::format(" {} {:<{}}", property, shown(value), last ? 0 : width_of(column));
    }
    text += '\n';
  }
  return text;
}

int run_list(const CamerasOptions& options) {
  const auto usb = usb_lines(options);
  if (!usb) return fail_cameras(usb.error());
  nlohmann::json list = nlohmann::json::array();
  std::string text;
  std::vector<std::string_view> not_discoverable;
  for (const cameras::CameraMake& make : cameras::camera_makes()) {
    if (make.discover == nullptr) {
      not_discoverable.push_back(make.name.driver);
      continue;
    }
    const std::vector<KeyPairs> found = make.discover();
    text += lines_of(make.name.driver, found);
    for (const KeyPairs& camera : found) {
      nlohmann::json& entry = list.emplace_back(nlohmann::json{{"driver", make.name.driver}});
      for (const auto& [property, value] : camera) entry[property] = value;
    }
  }
  for (const std::string& each : *usb) list.push_back({{"usb", each}});
  if (options.json) {
    fmt::print("{}\n", json_line(list));
    return kExitOk;
  }
  fmt::print("{}", text.empty() ? "no camera answers; mocapctl doctor examines this machine\n" : text);
  for (const std::string& each : *usb) fmt::print("usb     {}\n", each);
  fmt::print("not listed: cameras with driver {}; they cannot be discovered\n", fmt::join(not_discoverable, ", "));
  return kExitOk;
}

using Features = Result<std::vector<cameras::FeatureValue>>;

// Features of the camera with this name in the configuration.
Features features_by_name(const CamerasOptions& options) {
  const auto settings = settings::load_daemon_settings(options.config);
  if (!settings) return Error{ErrorCode::InvalidArgument, settings::to_text(settings.error())};
  const auto camera = std::ranges::find(settings->cameras, options.camera, &cameras::CameraSettings::name);
  if (camera == settings->cameras.end()) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("{} has no camera '{}'", options.config.string(), options.camera)};
  }
  const cameras::CameraMake* const make = cameras::find_make(camera->driver.driver());
  if (make == nullptr || make->describe == nullptr) {
    return Error{ErrorCode::InvalidArgument,
                 fmt::format("camera '{}': cameras with driver {} have no features beside their settings",
                             options.camera, camera->driver.driver())};
  }
  return make->describe(camera->driver);
}

// Features of the camera of any make that has this address, MAC or serial number.
Features features_by_word(const std::string& word) {
  Error missing{ErrorCode::NotFound, fmt::format("no camera {}", word)};
  for (const cameras::CameraMake& make : cameras::camera_makes()) {
    if (make.describe == nullptr) continue;
    Features features = make.describe(make.identified_by(word));
    if (features || features.error().code != ErrorCode::NotFound) return features;
    missing = features.error();
  }
  return missing;
}

int run_describe(const CamerasOptions& options) {
  const Features features = options.config.empty() ? features_by_word(options.camera) : features_by_name(options);
  if (!features) return fail_cameras(features.error());
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
    fmt::print("{}\n", json_line(list));
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

// Starts the camera, again while the search for it goes on, and returns the first complete image.
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
  return Error{ErrorCode::Timeout,
               broken.empty() ? "the camera is open, but no image came within 10 s; is the camera triggered?" : broken};
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
    return fail_cameras(
        {ErrorCode::InvalidArgument, fmt::format("{} has no camera '{}'", options.config.string(), options.camera)});
  }
  const CameraId id{static_cast<std::uint32_t>(found - settings->cameras.begin())};
  const auto camera = cameras::open_camera(
      id, *found, {.rig = &settings->rig, .marker_set = &settings->simulated[id.value], .counters = nullptr});
  if (!camera) return fail_cameras(camera.error());
  const auto frame = first_image(**camera);
  if (!frame) return fail_cameras(frame.error());
  const Image& image = frame->image;
  const auto detector = detect::make_blob_detector(settings::detect_of(*settings, id), image.format, image.width_px,
                                                   image.height_px, settings->rig[id.value].masks);
  if (!detector) return fail_cameras(detector.error());
  const Detection detection = (*detector)->detect(image);
  if (const Status saved = save_shot(options.out, image, detection.blobs); !saved) {
    fail_cameras(saved.error());
    return kExitCannotWrite;
  }
  fmt::print("{}: {}x{}, {} blobs, threshold {:.0f} grey\n", options.out.string(), image.width_px, image.height_px,
             detection.blobs.size(), detection.threshold_grey);
  return kExitOk;
}

}  // namespace

void add_cameras_command(cli::App& app, std::function<int()>& chosen) {
  auto options = std::make_shared<CamerasOptions>();
  cli::App* const command = app.add_subcommand("cameras", "lists cameras, describes their features, saves an image");
  command->examples(
      "  mocapctl cameras list\n"
      "  mocapctl cameras describe 192.168.10.2");
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
  cli::App* const list = add("list", "each connected camera that can be discovered, and the load of the USB", run_list);
  list->examples(
      "  mocapctl cameras list\n"
      "  mocapctl cameras list --config my.toml --json");
  list->add_flag("--json", options->json, "a JSON array");
  list->add_option("--config", options->config, "also the bandwidth that its cameras need on each USB bus")
      ->check(cli::ExistingFile{});
  list->add_option("--sys", options->sys, "the sysfs folder in which the kernel lists devices")->capture_default_str();
  cli::App* const describe = add("describe", "each feature of a camera with its value and range", run_describe);
  describe->examples(
      "  mocapctl cameras describe 192.168.10.2\n"
      "  mocapctl cameras describe north-east --config my.toml --json");
  describe->add_option("camera", options->camera, "an address, a serial number or a MAC; with --config, a name")
      ->required();
  describe->add_option("--config", options->config, "the daemon's configuration that has the camera")
      ->check(cli::ExistingFile{});
  describe->add_flag("--json", options->json, "a JSON array");
  cli::App* const shot = add("shot", "one image with the detected blobs drawn into it", run_shot);
  shot->examples("  mocapctl cameras shot north-east --config my.toml --out north-east.png");
  shot->add_option("camera", options->camera, "the camera's name in the configuration")->required();
  shot->add_option("--config", options->config, "the daemon's configuration")->required()->check(cli::ExistingFile{});
  shot->add_option("--out", options->out, "the PNG file to write")->capture_default_str();
}

}  // namespace mocap::ctl
