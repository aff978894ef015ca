#pragma once

#include <filesystem>
#include <vector>

#include "calibrate/gather_blobs.h"
#include "lib/cli/app.h"

namespace mocap::calibrate {

struct FloorOptions {
  RecordingOptions take;
  std::filesystem::path rig;  ///< empty: the configuration's
  std::filesystem::path out;  ///< empty: the rig
  std::vector<double> frame_mm{600.0, 400.0};
  bool by_markers = false;
  bool by_walk = false;
  double height_mm = 0.0;
  bool dry_run = false;
};

/// Adds the subcommand `floor`.
void add_floor_command(cli::App& app, FloorOptions& options);

/// Measures the floor and moves the world frame of a rig onto it. Returns the exit code of the program.
int run_floor(const FloorOptions& options);

}  // namespace mocap::calibrate
