#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calibrate/gather_blobs.h"
#include "calibration/wand/wand.h"
#include "lib/cli/app.h"

namespace mocap::calibrate {

struct WandOptions {
  RecordingOptions take;
  std::string wand = "500";
  std::filesystem::path rig;      ///< lenses, and the world frame to keep; empty: the configuration's, or `out`
  std::optional<double> fov_deg;  ///< horizontal field of view of the cameras without a calibrated lens
  bool fisheye = false;           ///< with fov_deg: fisheye lenses
  bool refine_lens = false;
  bool moved = false;                          ///< the cameras, or the scale, are not as in the rig
  std::filesystem::path out;                   ///< empty: the configuration's rig file
  std::vector<std::filesystem::path> reports;  ///< the suffix decides: .svg, .json, or text
  std::filesystem::path truth;                 ///< a true rig, for the report; empty: none
  bool dry_run = false;
  int threads = 2;
};

/// Adds the subcommand `wand`.
void add_wand_command(cli::App& app, WandOptions& options);

/// Records a waved wand, calibrates all cameras and writes the rig. Returns the exit code of the program.
int run_wand(const WandOptions& options);

}  // namespace mocap::calibrate
