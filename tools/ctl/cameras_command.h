#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace mocap::ctl {

/// `mocapctl cameras list`, `describe` and `shot`; `chosen` runs the one that was named.
void add_cameras_command(CLI::App& app, std::function<int()>& chosen);

}  // namespace mocap::ctl
