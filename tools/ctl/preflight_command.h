#pragma once

#include <functional>

#include "lib/cli/app.h"

namespace mocap::ctl {

/// Adds the subcommand `mocapctl preflight`. The parser sets `chosen` to the run function if the command line has it.
void add_preflight_command(cli::App& app, std::function<int()>& chosen);

}  // namespace mocap::ctl
