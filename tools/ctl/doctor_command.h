#pragma once

#include <functional>

#include "lib/cli/app.h"

namespace mocap::ctl {

/// `mocapctl doctor`; `chosen` runs it when it is the command that was named.
void add_doctor_command(cli::App& app, std::function<int()>& chosen);

}  // namespace mocap::ctl
