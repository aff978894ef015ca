#pragma once

#include <vector>

#include "lib/cli/app.h"
#include "model/calibration/calibration_order.h"

namespace mocap::cli {

/// How a command measures the floor.
struct FloorOptions {
  std::vector<double> frame_mm{600.0, 400.0};
  bool by_markers = false;
  bool by_walk = false;
  double height_mm = 0.0;
};

/// Adds --frame, --markers, --walk and --height. `options` must outlive App::parse().
void add_floor_options(App& app, FloorOptions& options);

FloorOrder floor_order(const FloorOptions& options);

}  // namespace mocap::cli
