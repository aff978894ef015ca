#pragma once

#include <cstddef>
#include <filesystem>

#include "detect/mask_learner.h"
#include "lib/cli/app.h"

namespace mocap::calibrate {

struct MaskOptions {
  std::filesystem::path config;
  std::filesystem::path rig;  ///< empty: the configuration's
  std::size_t frames = 200;   ///< of each camera
  detect::LearnMaskSettings learn;
  double most_percent = 20.0;  ///< of an image; more is refused
  bool dry_run = false;
  bool clear = false;
};

/// `mocap-calibrate mask`
void add_mask_command(cli::App& app, MaskOptions& options);

/// Runs all cameras of the configuration on an empty volume, learns what shines, and writes it into the rig. Gives the
/// program's exit code.
int run_mask(const MaskOptions& options);

}  // namespace mocap::calibrate
