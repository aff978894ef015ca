#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/key_visitor.h"
#include "cameras/driver_settings.h"

namespace mocap::cameras {

/// Images from files: a folder of numbered images or a video, with timestamps.csv beside them; or the blobs of a take
/// (take/take_camera.h). Help, units and ranges:
/// the table in replay_settings.cpp.
struct ReplaySettings {
  static constexpr MakeName kMake{"replay", "recorded images", "recorded"};

  std::filesystem::path folder;
  std::filesystem::path file;  ///< a take, instead of a folder
  double rate_hz = 60.0;
  double speed = 1.0;
  bool loop = false;
};

void declare_keys(KeyVisitor& keys, ReplaySettings& camera);
std::vector<KeyFault> faults_of(const ReplaySettings& camera);
CameraFacts facts_of(const ReplaySettings& camera, const std::string& camera_name);

}  // namespace mocap::cameras
