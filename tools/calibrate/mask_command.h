#pragma once

#include <cstddef>
#include <filesystem>

#include "detect/mask_learner.h"
#include "lib/cli/app.h"

namespace mocap::calibrate {

struct MaskOptions {
  std::filesystem::path config;
  std::filesystem::path rig;  ///< empty: the configuration's
  std::size_t frames = 200;   ///< images of each camera
  detect::LearnMaskSettings learn;
  double most_percent = 20.0;  ///< largest masked part of an image
  bool dry_run = false;
  bool clear = false;
};

/// Adds the subcommand `mask`.
void add_mask_command(cli::App& app, MaskOptions& options);

/// Runs all cameras of the configuration on an empty volume, learns masks of the lights and writes them into the rig.
/// Returns the exit code of the program.
int run_mask(const MaskOptions& options);

}  // namespace mocap::calibrate
