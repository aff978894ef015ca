#pragma once

#include "base/key_visitor.h"

namespace mocap::associate {

/// [triangulate]: the position of a marker. Help, units and ranges: the table in triangulate_settings.cpp.
struct TriangulateSettings {
  double calibration_px = 0.5;
  double agree_sigmas = 4.0;
  double max_sigma_m = 0.02;
};

void declare_keys(KeyVisitor& keys, TriangulateSettings& triangulate);

}  // namespace mocap::associate
