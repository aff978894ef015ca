#pragma once

#include "bench/cameras/cameras_bench.h"
#include "lib/cli/app.h"

namespace mocap::bench {

/// Adds the options of `mocap-bench cameras`.
void add_cameras_options(cli::App& command, CamerasBenchSettings& settings);

/// Runs the bench and prints the figures. Returns the exit code.
int cameras(const CamerasBenchSettings& settings, bool json);

}  // namespace mocap::bench
