#pragma once

#include <filesystem>

#include "calibrate/gather_blobs.h"
#include "lib/cli/app.h"
#include "lib/cli/floor_options.h"

namespace mocap::calibrate {

struct FloorOptions {
  RecordingOptions take;
  std::filesystem::path rig;  ///< empty: the configuration's
  std::filesystem::path out;  ///< empty: the rig
  cli::FloorOptions floor;
  bool dry_run = false;
};

/// Adds the subcommand `floor`.
void add_floor_command(cli::App& app, FloorOptions& options);

/// Measures the floor and moves the world frame of a rig onto it. Returns the exit code of the program.
int run_floor(const FloorOptions& options);

}  // namespace mocap::calibrate
