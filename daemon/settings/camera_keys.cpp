#include "settings/camera_keys.h"

#include <fmt/format.h>

#include <algorithm>
#include <type_traits>

namespace mocap::settings {
namespace {

using cameras::AravisSettings;
using cameras::CameraSettings;
using cameras::ReplaySettings;
using cameras::SyntheticSettings;
using cameras::V4l2Settings;

enum class Driver : std::size_t { Aravis, V4l2, Replay, Synthetic };  // by index of CameraSettings::driver

constexpr const char* kDriverWords[] = {"aravis", "v4l2", "replay", "synthetic"};

// The sizes of sensors, in px.
constexpr Range kSide_px{16, 16384};
constexpr Range kRate_hz{0.1, 10000};
constexpr Range kExposure_us{1, 1e6};

void tell(Keys& keys, AravisSettings& camera) {
  keys.text("serial", camera.serial);
  keys.text("device_name", camera.device_name);
  keys.text("address", camera.address);
  keys.text("mac", camera.mac);
  keys.one_of("pixel_format", camera.pixel_format,
              {"Mono8", "Mono10", "Mono12", "Mono10p", "Mono12p", "Mono10Packed", "Mono12Packed", "BayerGR8",
               "BayerRG8", "BayerGB8", "BayerBG8"});
  keys.number("x_px", camera.x_px, {0, kSide_px.max});
  keys.number("y_px", camera.y_px, {0, kSide_px.max});
  keys.number("width_px", camera.width_px, kSide_px);
  keys.number("height_px", camera.height_px, kSide_px);
  keys.number("rate_hz", camera.rate_hz, kRate_hz);
  keys.number("exposure_us", camera.exposure_us, kExposure_us);
  keys.number("gain_db", camera.gain_db, {0, 60});
  keys.text("trigger", camera.trigger);
  keys.number("packet_size_bytes", camera.packet_size_bytes, {576, 65507});  // least IPv4 datagram; greatest over UDP
  keys.flag("packet_socket", camera.packet_socket);
  keys.number("stream_buffers", camera.stream_buffers, {2, 1024});
  keys.number("delivery_us", camera.delivery_us, {0, 1e6});
  keys.one_of("clock", camera.clock, {"estimated", "utc"});
  keys.flag("ptp", camera.ptp);
  keys.flag("chunks", camera.chunks);
  keys.one_of("stamps", camera.stamps, {"start", "middle", "end"});
  keys.pairs("features", camera.features);
}

void tell(Keys& keys, V4l2Settings& camera) {
  keys.path("device", camera.device);
  keys.text("serial", camera.serial);
  keys.text("bus", camera.bus);
  keys.one_of("pixel_format", camera.pixel_format,
              {"GREY", "Y10", "Y12", "GRBG", "RGGB", "GBRG", "BA81", "YUYV", "NV12", "MJPEG"});
  keys.number("width_px", camera.width_px, kSide_px);
  keys.number("height_px", camera.height_px, kSide_px);
  keys.number("rate_hz", camera.rate_hz, kRate_hz);
  keys.number("exposure_us", camera.exposure_us, kExposure_us);
  keys.number("gain", camera.gain, {0, 1e6});
  keys.number("buffers", camera.buffers, {2, 32});  // VIDEO_MAX_FRAME
}

void tell(Keys& keys, ReplaySettings& camera) {
  keys.path("folder", camera.folder);
  keys.number("rate_hz", camera.rate_hz, kRate_hz);
  keys.number("speed", camera.speed, {0, 1000});
  keys.flag("loop", camera.loop);
}

void tell(Keys& keys, SyntheticSettings& camera) {
  keys.text("motion", camera.motion);
  keys.path("marker_set", camera.marker_set);
  keys.number("width_px", camera.width_px, kSide_px);
  keys.number("height_px", camera.height_px, kSide_px);
  keys.number("rate_hz", camera.rate_hz, kRate_hz);
  keys.number("exposure_us", camera.exposure_us, kExposure_us);
  keys.number("noise_grey", camera.noise_grey, {0, 100});
  keys.number("seed", camera.seed, {0, 9e15});
  keys.number("speed", camera.speed, {0, 1000});
}

Driver driver_index(const CameraSettings& camera) { return static_cast<Driver>(camera.driver.index()); }

void set_driver(CameraSettings& camera, Driver driver) {
  switch (driver) {
    case Driver::Aravis: camera.driver = AravisSettings{}; return;
    case Driver::V4l2: camera.driver = V4l2Settings{}; return;
    case Driver::Replay: camera.driver = ReplaySettings{}; return;
    case Driver::Synthetic: camera.driver = SyntheticSettings{}; return;
  }
}

void check(TomlTable& table, const AravisSettings& camera) {
  const int said = !camera.serial.empty() + !camera.device_name.empty() + !camera.address.empty() + !camera.mac.empty();
  if (said != 1) {
    table.fault(fmt::format("{} of serial, device_name, address and mac are set, expected exactly one", said));
  }
  const bool line =
      camera.trigger.starts_with("Line") && camera.trigger.size() > 4 &&
      std::all_of(camera.trigger.begin() + 4, camera.trigger.end(), [](char c) { return c >= '0' && c <= '9'; });
  if (camera.trigger != "free_run" && camera.trigger != "software" && !line) {
    table.fault("trigger", fmt::format("trigger is '{}', expected free_run, software, or a line: Line0, Line1, ...",
                                       camera.trigger));
  }
}

void check(TomlTable& table, const V4l2Settings& camera) {
  const int said = !camera.device.empty() + !camera.serial.empty() + !camera.bus.empty();
  if (said == 0) table.require("device", "/dev/video0, or a stable link under /dev/v4l/by-path (or serial, or bus)");
  if (said > 1) table.fault(fmt::format("{} of device, serial and bus are set, expected exactly one", said));
}

void check(TomlTable& table, const ReplaySettings& camera) {
  if (camera.folder.empty()) {
    table.require("folder", "the folder of this camera's images");
  } else if (std::error_code ignored; !std::filesystem::exists(camera.folder, ignored)) {
    table.fault("folder", fmt::format("folder is '{}', and there is none", camera.folder.string()));
  }
}

void check(TomlTable& table, const SyntheticSettings& camera) {
  if (camera.marker_set.empty()) table.require("marker_set", "a file of config/markersets");
}

// A name stands in logs, in the rig, on the wire and in the names of folders.
void check_name(TomlTable& table, const std::string& name) {
  const auto bad = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == '/' || c == '\'' || c == '"'; };
  if (name.empty() || name.size() > 63 || std::any_of(name.begin(), name.end(), bad)) {
    table.fault("name", fmt::format("name is '{}', expected 1 to 63 characters without quotes and slashes", name));
  }
}

template <class Number>
std::optional<ImageSize> size_from(const std::optional<Number>& width_px, const std::optional<Number>& height_px) {
  if (!width_px || !height_px) return std::nullopt;
  return ImageSize{*width_px, *height_px};
}

}  // namespace

void tell(Keys& keys, CameraSettings& camera) {
  keys.text("name", camera.name);
  Driver driver = driver_index(camera);
  keys.choice<Driver>("driver", driver,
                      {{"aravis", Driver::Aravis},
                       {"v4l2", Driver::V4l2},
                       {"replay", Driver::Replay},
                       {"synthetic", Driver::Synthetic}});
  if (driver != driver_index(camera)) set_driver(camera, driver);
  keys.number("threshold", camera.threshold, {0, 255});
  keys.number("low_threshold", camera.low_threshold, {0, 255});
  std::visit([&](auto& settings) { tell(keys, settings); }, camera.driver);
}

CameraSettings read_camera(TomlTable& table) {
  CameraSettings camera;
  table.text("name", camera.name);
  if (!camera.name.empty()) table.call(fmt::format("camera '{}'", camera.name));
  const bool named = table.require("name", "the camera's name in the log, in the rig and on the wire");
  if (named) check_name(table, camera.name);
  if (!table.require("driver", "aravis, v4l2, replay or synthetic")) return camera;
  std::string driver;
  table.one_of("driver", driver, {std::begin(kDriverWords), std::end(kDriverWords)});
  if (driver.empty()) return camera;  // of no known driver, no other key can be judged
  tell(table, camera);
  std::visit([&](const auto& settings) { check(table, settings); }, camera.driver);
  if (camera.threshold && *camera.threshold > 0.0 && *camera.threshold < 1.0) {
    table.fault("threshold",
                fmt::format("threshold is {}, expected 1 to 255, or 0: from the noise", *camera.threshold));
  }
  table.done();
  return camera;
}

const char* driver_of(const CameraSettings& camera) { return kDriverWords[camera.driver.index()]; }

std::optional<double> rate_hz_of(const CameraSettings& camera) {
  return std::visit([](const auto& settings) -> std::optional<double> { return settings.rate_hz; }, camera.driver);
}

std::optional<ImageSize> size_of(const CameraSettings& camera) {
  if (const auto* aravis = std::get_if<AravisSettings>(&camera.driver))
    return size_from(aravis->width_px, aravis->height_px);
  if (const auto* v4l2 = std::get_if<V4l2Settings>(&camera.driver)) return ImageSize{v4l2->width_px, v4l2->height_px};
  if (const auto* synthetic = std::get_if<SyntheticSettings>(&camera.driver)) {
    return ImageSize{synthetic->width_px, synthetic->height_px};
  }
  return std::nullopt;
}

}  // namespace mocap::settings
