#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/key_visitor.h"
#include "cameras/driver_settings.h"

namespace mocap::cameras {

/// A feature of a camera by its GenICam name, and its value as text.
using Feature = std::pair<std::string, std::string>;

/// A GigE Vision or USB3 Vision camera. Help, units and ranges: the table in aravis_settings.cpp. An empty field leaves
/// the camera's own value.
struct AravisSettings {
  static constexpr MakeName kMake{"aravis", "GigE Vision or USB3 Vision", "north-east"};

  std::string serial;
  std::string device_name;
  std::string address;
  std::string mac;
  std::string pixel_format = "Mono8";
  std::optional<int> x_px, y_px, width_px, height_px;
  std::optional<double> rate_hz;
  std::optional<double> exposure_us;
  std::optional<double> gain_db;
  std::string trigger = "free_run";
  std::optional<int> packet_size_bytes;  ///< empty: negotiated
  bool packet_socket = true;
  int stream_buffers = 16;
  double delivery_us = 0.0;
  std::string clock = "estimated";
  bool ptp = false;
  bool chunks = true;
  std::string stamps = "start";
  std::vector<Feature> features;
};

void declare_keys(KeyVisitor& keys, AravisSettings& camera);
std::vector<KeyFault> faults_of(const AravisSettings& camera);
CameraFacts facts_of(const AravisSettings& camera, const std::string& camera_name);

}  // namespace mocap::cameras
