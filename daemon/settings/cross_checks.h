#pragma once

#include <vector>

#include "settings/daemon_settings.h"
#include "settings/toml_file.h"

namespace mocap::settings {

/// The tables that a daemon configuration was read from, for the places of faults.
struct DaemonTables {
  TomlTable root;
  std::vector<TomlTable> cameras;   ///< as DaemonSettings::cameras
  std::vector<TomlTable> subjects;  ///< as DaemonSettings::subjects
};

/// What one key alone cannot tell: names twice, cameras twice, times that do not go together. Makes faults of them.
void check_together(DaemonTables& tables, const DaemonSettings& settings);

/// Whether the rig has every camera, in the size that it is run at. Makes faults of those that are not; the rig's
/// entries by CameraId, where all are there.
Rig rig_for(DaemonTables& tables, const DaemonSettings& settings, const Rig& rig);

}  // namespace mocap::settings
