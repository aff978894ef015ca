#pragma once

#include <functional>

#include "lib/cli/app.h"

namespace mocap::ctl {

/// Adds `bridge list`: the bridges of this machine, and who is connected to each. `chosen` gets the command that runs.
void add_bridge_command(cli::App& app, std::function<int()>& chosen);

}  // namespace mocap::ctl
