#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "settings/faults.h"
#include "settings/state_folder.h"

namespace mocap::settings {

/// One value in force and its source.
struct SettingInForce {
  std::string key;    ///< "align.window_us"; of a camera "camera.north-east.driver", of a subject "subject.anna.keep"
  std::string value;  ///< as a TOML file has it
  std::string from;   ///< "FILE:LINE", "FILE" of a part that stands in a file of its own, or "default"
};

/// The files of a configuration in the order in which they are read.
struct ReadFile {
  std::filesystem::path path;
  std::string content;  ///< in a few words
  bool exists = false;
};

struct InForce {
  std::vector<ReadFile> files;
  std::vector<SettingInForce> settings;
  std::vector<std::string> notes;  ///< DaemonSettings::state_notes
};

/// Every setting with its value and its source. Fails with all faults of the files.
Result<InForce, Faults> settings_in_force(const std::filesystem::path& configuration, const StateFiles& state);

}  // namespace mocap::settings
