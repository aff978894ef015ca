#pragma once

#include <functional>

#include "lib/cli/app.h"

namespace mocap::ctl {

/// Adds the subcommand `mocapctl doctor`. The parser sets `chosen` to the run function if the command line has it.
void add_doctor_command(cli::App& app, std::function<int()>& chosen);

}  // namespace mocap::ctl
