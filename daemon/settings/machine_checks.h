#pragma once

#include <filesystem>

#include "settings/daemon_settings.h"
#include "settings/faults.h"
#include "settings/state_folder.h"

namespace mocap::settings {

/// Faults of a configuration that depend on the machine and the user of the check, for --check-config: folders in which
/// the daemon writes files ([record], keep of a subject, ipc endpoints) and processors of [realtime]. `path`: the
/// configuration that `settings` was read from. A folder for kept fits, or in the state folder, is made by the daemon
/// and need not exist.
Faults machine_faults(const DaemonSettings& settings, const std::filesystem::path& path, const StateFiles& state = {});

}  // namespace mocap::settings
