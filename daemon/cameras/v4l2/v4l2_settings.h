#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/key_visitor.h"
#include "cameras/driver_settings.h"

namespace mocap::cameras {

/// A camera of the Linux kernel's video API. Help, units and ranges: the table in v4l2_settings.cpp. An empty field
/// leaves the camera's own value.
struct V4l2Settings {
  static constexpr MakeName kMake{"v4l2", "camera of the Linux kernel (UVC and others)", "door"};

  std::filesystem::path device;
  std::string serial;
  std::string bus;
  std::string pixel_format = "GREY";
  int width_px = 640;
  int height_px = 480;
  double rate_hz = 30.0;
  std::optional<double> exposure_us;
  std::optional<double> gain;
  int buffers = 4;
};

void declare_keys(KeyVisitor& keys, V4l2Settings& camera);
std::vector<KeyFault> faults_of(const V4l2Settings& camera);
CameraFacts facts_of(const V4l2Settings& camera, const std::string& camera_name);

}  // namespace mocap::cameras
