#pragma once

#include <optional>
#include <vector>

#include "base/key_visitor.h"

namespace mocap::detect {

/// [detect]. Help, units and ranges: the table in detect_settings.cpp. Grey levels are those of 8 bits, 0 to 255,
/// whatever the pixel format; deeper formats are scaled.
struct DetectSettings {
  std::optional<double> threshold = std::nullopt;      ///< empty: estimated from the image noise
  std::optional<double> low_threshold = std::nullopt;  ///< empty: estimated from the image noise
  double min_area_px2 = 4.0;
  double max_area_px2 = 5000.0;
  double min_roundness = 0.3;
  double min_peak_grey = 0.0;
  bool split_touching = true;
  int grow_px = 2;
};

void declare_keys(KeyVisitor& keys, DetectSettings& detect);

/// Returns the rules between several keys that the settings break.
std::vector<KeyFault> faults_of(const DetectSettings& detect);

}  // namespace mocap::detect
