#include "cameras/v4l2/v4l2_settings.h"

#include <fmt/format.h>

#include "cameras/v4l2/v4l2_formats.h"

namespace mocap::cameras {
namespace {

std::vector<std::string_view> format_names() {
  std::vector<std::string_view> names;
  for (const KnownFormat& each : known_video_formats()) names.emplace_back(each.name);
  return names;
}

}  // namespace

void declare_keys(KeyVisitor& keys, V4l2Settings& camera) {
  constexpr KeyRange kSide_px{16, 16384};
  keys.path("device", camera.device,
            {.help = "or a stable link under /dev/v4l/by-path; exactly one of device, serial and bus says which camera",
             .example = "/dev/video0",
             .example_is_active = true});
  keys.text("serial", camera.serial, {.help = "serial number of the USB device", .example = "3F2A11"});
  keys.text("bus", camera.bus,
            {.help = "USB port, as mocapctl cameras list shows it", .example = "usb-0000:00:14.0-2"});
  keys.one_of("pixel_format", camera.pixel_format, format_names(),
              {.help = "of a Bayer format (GRBG, RGGB, GBRG, BA81) the green pixels are used"});
  keys.number("width_px", camera.width_px, kSide_px);
  keys.number("height_px", camera.height_px, kSide_px);
  keys.number("rate_hz", camera.rate_hz, {0.1, 10000}, {.help = "images per second"});
  keys.number("exposure_us", camera.exposure_us, {1, 1e6},
              {.help = "the camera's own value if absent", .example = "1000"});
  keys.number("gain", camera.gain, {0, 1e6}, {.help = "in the unit of the kernel's driver", .example = "10"});
  keys.number("buffers", camera.buffers, {2, 32}, {.help = "images that may wait for the daemon"});  // VIDEO_MAX_FRAME
}

std::vector<KeyFault> faults_of(const V4l2Settings& camera) {
  const int given = int{!camera.device.empty()} + int{!camera.serial.empty()} + int{!camera.bus.empty()};
  if (given == 1) return {};
  if (given == 0) {
    return {{"device",
             "device is missing, expected /dev/video0, or a stable link under /dev/v4l/by-path (or serial, or bus)"}};
  }
  return {{"", fmt::format("{} of device, serial and bus are set, expected exactly one", given)}};
}

CameraFacts facts_of(const V4l2Settings& camera, const std::string& /*camera_name*/) {
  return {.rate_hz = camera.rate_hz,
          .exposure_us = camera.exposure_us,
          .size = ImageSize{camera.width_px, camera.height_px},
          .device = {{"serial", camera.serial}, {"bus", camera.bus}, {"device", camera.device.string()}}};
}

}  // namespace mocap::cameras
