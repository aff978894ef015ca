#pragma once

#include <functional>

#include "lib/cli/app.h"

namespace mocap::ctl {

/// Adds the command `bridge list`, which prints the bridges of this machine and the receivers of each bridge. Parsing a
/// command line with that command sets `chosen` to the function that executes the command.
void add_bridge_command(cli::App& app, std::function<int()>& chosen);

}  // namespace mocap::ctl
