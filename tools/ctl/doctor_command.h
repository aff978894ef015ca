#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace mocap::ctl {

/// `mocapctl doctor`; `chosen` runs it when it is the command that was named.
void add_doctor_command(CLI::App& app, std::function<int()>& chosen);

}  // namespace mocap::ctl
