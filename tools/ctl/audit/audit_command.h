#pragma once

#include <functional>

#include "lib/cli/app.h"

namespace mocap::ctl {

/// Adds `mocapctl audit`. The parser sets `chosen` to the command.
void add_audit_command(cli::App& app, std::function<int()>& chosen);

}  // namespace mocap::ctl
