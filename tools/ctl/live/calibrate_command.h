#pragma once

#include "ctl/live/live_command.h"

namespace mocap::ctl {

/// Adds `calibrate`: the running daemon calibrates its cameras. The parser sets `options.run` to the chosen command.
void add_calibrate_command(cli::App& app, LiveOptions& options);

}  // namespace mocap::ctl
