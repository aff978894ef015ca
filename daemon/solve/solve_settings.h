#pragma once

#include "base/key_visitor.h"
#include "pose/smooth_settings.h"

namespace mocap::solve {

/// [solve]: the skeleton. Help, units and ranges: the table in solve_settings.cpp.
struct SolveSettings {
  double marker_sigma_m = 0.003;
  double outlier_m = 0.05;
  double fill_for_s = 2.0;
  int max_iterations = 6;
  pose::SmoothSettings smoothing{};
};

void declare_keys(KeyVisitor& keys, SolveSettings& solve);

}  // namespace mocap::solve
