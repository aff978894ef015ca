#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "settings/daemon_settings.h"
#include "settings/toml_file.h"

namespace mocap::settings {

/// The tables that a daemon configuration was read from, for the places of faults.
struct DaemonTables {
  TomlTable root;
  std::map<std::string, TomlTable, std::less<>> sections;  ///< those that the file has, by name
  std::vector<TomlTable> cameras;                          ///< as DaemonSettings::cameras
  std::vector<TomlTable> subjects;                         ///< as DaemonSettings::subjects

  /// The section, or the whole file if it does not have the section: the place of a fault.
  TomlTable& section(std::string_view name);
};

/// What one key alone cannot tell: names twice, cameras twice, times that do not go together. Makes faults of them.
void check_together(DaemonTables& tables, const DaemonSettings& settings);

/// Whether the rig has every camera, in the size that it is run at. Makes faults of those that are not; the rig's
/// entries by CameraId, where all are there.
Rig rig_for(DaemonTables& tables, const DaemonSettings& settings, const Rig& rig);

}  // namespace mocap::settings
