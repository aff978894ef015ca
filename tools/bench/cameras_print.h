#pragma once

#include "cameras_bench.h"
#include "lib/cli/app.h"

namespace mocap::bench {

/// The options of `mocap-bench cameras`.
void tell_cameras(cli::App& command, CamerasBenchSettings& settings);

/// Runs it and prints the figures; the exit code.
int cameras(const CamerasBenchSettings& settings, bool json);

}  // namespace mocap::bench
