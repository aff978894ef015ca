#pragma once

#include <functional>

#include "lib/cli/app.h"

namespace mocap::ctl {

/// `mocapctl nodes`; `chosen` runs it.
void add_nodes_command(cli::App& app, std::function<int()>& chosen);

}  // namespace mocap::ctl
