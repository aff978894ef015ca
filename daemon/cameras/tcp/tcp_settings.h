#pragma once

#include <string>
#include <vector>

#include "base/key_visitor.h"
#include "cameras/driver_settings.h"
#include "model/frame.h"

namespace mocap::cameras {

/// Raw images from a program that listens on a TCP port. Help, units and ranges: the table in tcp_settings.cpp.
struct TcpSettings {
  static constexpr MakeName kMake{"tcp", "raw images from another program over TCP", "network"};

  std::string address;
  int port = 5600;
  int width_px = 640;
  int height_px = 480;
  PixelFormat pixel_format = PixelFormat::Mono8;
  double rate_hz = 60.0;
  bool stamps_are_utc = false;
};

void declare_keys(KeyVisitor& keys, TcpSettings& camera);
std::vector<KeyFault> faults_of(const TcpSettings& camera);
CameraFacts facts_of(const TcpSettings& camera, const std::string& camera_name);

}  // namespace mocap::cameras
