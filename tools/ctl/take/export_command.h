#pragma once

#include <functional>

#include "lib/cli/app.h"

namespace mocap::ctl {

/// Adds `export` to `mocapctl take`. The parser sets `chosen` if the command line has it.
void add_export_command(cli::App& take, std::function<int()>& chosen);

}  // namespace mocap::ctl
