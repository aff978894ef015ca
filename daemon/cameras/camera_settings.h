#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/key_visitor.h"
#include "cameras/driver_settings.h"

namespace mocap::cameras {

/// A [[camera]] of the configuration. The keys are declared in camera_settings.cpp and, for each make, in
/// <make>_settings.cpp.
struct CameraSettings {
  std::string name;
  DriverSettings driver;
  /// Settings of the detector for this camera's images alone; empty: those of [detect]. A threshold of 0 is estimated
  /// from the image noise.
  std::optional<double> threshold = std::nullopt;
  std::optional<double> low_threshold = std::nullopt;
};

/// Declares the keys of every camera, then those of its make. If a visitor sets the key `driver` to another make,
/// `camera.driver` is replaced by the defaults of that make; an unknown make changes nothing.
void declare_keys(KeyVisitor& keys, CameraSettings& camera);

/// The facts that the settings of the camera's make state.
CameraFacts facts_of(const CameraSettings& camera);

/// The broken rules between keys, including those of the make.
std::vector<KeyFault> faults_of(const CameraSettings& camera);

}  // namespace mocap::cameras
