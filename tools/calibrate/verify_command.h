#pragma once

#include <filesystem>
#include <string>

#include "calibrate/gather_blobs.h"
#include "calibrate/standing.h"
#include "lib/cli/app.h"

namespace mocap::calibrate {

/// What to say of a camera that was bumped while a take was made.
std::string words_of(const MovedMeanwhile& moved, const Rig& rig);

struct VerifyOptions {
  TakeOptions take;
  std::filesystem::path rig;  ///< empty: the configuration's
  double drift_px = 1.0;
};

/// `mocap-calibrate verify`
void add_verify_command(cli::App& app, VerifyOptions& options);

/// Says, camera by camera, whether the rig is still right. Gives the program's exit code: kExitData where a camera
/// stands otherwise, or where nothing can be told.
int run_verify(const VerifyOptions& options);

struct RefineOptions {
  VerifyOptions verify;
  std::filesystem::path out;  ///< empty: the rig
  bool dry_run = false;
  int threads = 2;
};

/// `mocap-calibrate refine`
void add_refine_command(cli::App& app, RefineOptions& options);

/// Mends cameras that were bumped from what the others see, then all of them, by any moving markers. Gives the
/// program's exit code.
int run_refine(const RefineOptions& options);

}  // namespace mocap::calibrate
