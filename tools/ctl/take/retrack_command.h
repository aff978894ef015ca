#pragma once

#include <functional>

#include "lib/cli/app.h"

namespace mocap::ctl {

/// Adds the subcommand "retrack" to "take". Its callback sets `chosen`.
void add_retrack_command(cli::App& take, std::function<int()>& chosen);

}  // namespace mocap::ctl
