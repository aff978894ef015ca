#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/key_visitor.h"
#include "base/time.h"
#include "cameras/driver_settings.h"

namespace mocap::cameras {

/// A camera of the simulated volume, in this process. Help, units and ranges: the table in synthetic_settings.cpp.
struct SyntheticSettings {
  static constexpr MakeName kMake{"synthetic", "simulated camera in this process: no hardware", "simulated"};

  std::string motion = "tpose:2,walk";
  std::filesystem::path marker_set;
  int width_px = 640;
  int height_px = 480;
  double rate_hz = 60.0;
  double exposure_us = 500.0;
  double noise_grey = 2.0;
  std::uint64_t seed = 1;
  double speed = 1.0;
  /// Not a key. Exposures are at whole periods after this time, and the motion begins at it; the same for all cameras
  /// (decisions/0002).
  Timestamp epoch;
};

void declare_keys(KeyVisitor& keys, SyntheticSettings& camera);
std::vector<KeyFault> faults_of(const SyntheticSettings& camera);
CameraFacts facts_of(const SyntheticSettings& camera, const std::string& camera_name);

}  // namespace mocap::cameras
