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
  TakeOptions take;
  std::string wand = "500";
  std::filesystem::path rig;      ///< names, lenses and, to keep the floor, places; empty: the configuration's
  std::optional<double> fov_deg;  ///< instead of lenses: how wide the cameras look, about
  bool fisheye = false;           ///< lenses that are not known are fisheye ones
  bool refine_lens = false;
  bool moved = false;                          ///< the cameras do not stand where the rig says
  std::filesystem::path out;                   ///< empty: the configuration's rig file
  std::vector<std::filesystem::path> reports;  ///< .svg, .json or text, by their names
  std::filesystem::path truth;                 ///< a rig that is known to be right, for the report; empty: none
  bool dry_run = false;
  int threads = 2;
};

/// A preset by its length in mm (250, 400, 500), or places of two or three markers in mm: "0,160,500".
Result<calibration::Wand> parse_wand(const std::string& text);

/// `mocap-calibrate wand`
void add_wand_command(cli::App& app, WandOptions& options);

/// Gathers a take of a waved wand, solves for all cameras and writes the rig. Gives the program's exit code.
int run_wand(const WandOptions& options);

}  // namespace mocap::calibrate
