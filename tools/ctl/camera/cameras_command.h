#pragma once

#include <functional>

#include "lib/cli/app.h"

namespace mocap::ctl {

/// `mocapctl cameras list`, `describe` and `shot`; `chosen` runs the one that was named.
void add_cameras_command(cli::App& app, std::function<int()>& chosen);

}  // namespace mocap::ctl
