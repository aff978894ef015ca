#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/key_visitor.h"
#include "cameras/driver_settings.h"

namespace mocap::cameras {

/// One [[camera]] of the configuration. The keys: camera_settings.cpp, and the make's own.
struct CameraSettings {
  std::string name;
  DriverSettings driver;
  /// Settings of the detector for this camera's images alone; empty: those of [detect]. A threshold of 0 is estimated
  /// from the image noise.
  std::optional<double> threshold = std::nullopt;
  std::optional<double> low_threshold = std::nullopt;
};

/// The keys of every camera and those of its make. A visitor that sets the key `driver` to another make replaces
/// `camera.driver` by the defaults of that make. An unknown make leaves it as it is.
void declare_keys(KeyVisitor& keys, CameraSettings& camera);

/// Answers of the camera's make.
CameraFacts facts_of(const CameraSettings& camera);

/// Rules between keys that are broken, the make's own included.
std::vector<KeyFault> faults_of(const CameraSettings& camera);

}  // namespace mocap::cameras
