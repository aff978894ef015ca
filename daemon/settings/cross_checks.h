#pragma once

#include <functional>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "settings/daemon_settings.h"
#include "settings/toml/toml_file.h"

namespace mocap::settings {

/// The tables of a configuration file: the places of its faults.
struct DaemonTables {
  TomlTable root;
  std::map<std::string, TomlTable, std::less<>> sections;  ///< those that the file has, by name
  std::vector<TomlTable> cameras;                          ///< as DaemonSettings::cameras
  std::vector<TomlTable> subjects;                         ///< as DaemonSettings::subjects

  /// The section, or the whole file if it does not have the section: the place of a fault.
  TomlTable& section(std::string_view name);
};

/// Adds a fault for each rule between keys that is broken: those of the sections, and those between tables (names and
/// devices that occur twice, times that contradict each other).
void check_together(DaemonTables& tables, const DaemonSettings& settings);

/// The rig's entries by CameraId. Adds a fault for each camera that is not in the rig, or is there with another image
/// size.
Rig rig_for(DaemonTables& tables, const DaemonSettings& settings, const Rig& rig);

}  // namespace mocap::settings
