#pragma once

#include <functional>

#include "lib/cli/app.h"

namespace mocap::ctl {

/// Adds `mocapctl config show`. The parser sets `chosen` to the run function if the command line has it.
void add_config_command(cli::App& app, std::function<int()>& chosen);

}  // namespace mocap::ctl
