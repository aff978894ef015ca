#pragma once

#include "base/key_visitor.h"

namespace mocap::pose {

/// The low-pass filter of poses, keys of [solve]. Help, units and ranges: the table in smooth_settings.cpp.
struct SmoothSettings {
  double min_cutoff_hz = 0.0;
  double beta = 0.5;

  bool operator==(const SmoothSettings&) const = default;
};

void declare_keys(KeyVisitor& keys, SmoothSettings& smooth);

}  // namespace mocap::pose
