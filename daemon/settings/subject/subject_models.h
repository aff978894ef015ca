#pragma once

#include "settings/cross_checks.h"
#include "settings/daemon_settings.h"
#include "settings/toml/toml_file.h"

namespace mocap::settings {

/// Reads the marker sets and the fitted bodies of all subjects, and the marker sets of simulated cameras, into
/// `settings`. Faults are added to `file`, at the key that names the file.
void load_subject_models(TomlFile& file, DaemonTables& tables, DaemonSettings& settings);

}  // namespace mocap::settings
