#pragma once

#include "base/key_visitor.h"

namespace mocap::drift {

/// [watch]: cameras that moved since the calibration. Help, units and ranges: the table in drift_settings.cpp.
struct DriftSettings {
  double drift_px = 1.0;
  double reach_deg = 1.0;
  double memory_s = 3.0;
};

void declare_keys(KeyVisitor& keys, DriftSettings& drift);

}  // namespace mocap::drift
