#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "base/result.h"
#include "settings/daemon_settings.h"
#include "take/take_reader.h"
#include "take/take_writer.h"

namespace mocap::retrack {

/// Files that replace those of a take. An empty path: the take's own.
struct OtherFiles {
  std::filesystem::path settings = {};  ///< a configuration
  std::filesystem::path rig = {};
  /// A folder of subject files: NAME.toml replaces the body of the subject NAME. Subjects without a file keep theirs.
  std::filesystem::path subjects = {};
};

/// The settings with which a take is tracked again.
struct TakeSettings {
  std::unique_ptr<settings::DaemonSettings> settings;
  std::vector<TakeFile> files;  ///< of these settings, for the new take
};

/// Loads the settings of a take from the files that it carries, with other files where these are given.
///
/// Fails with InvalidArgument (faults of a file, with all of them in the message; a rig without one of the cameras; a
/// body with other markers), NotFound (a file, the configuration in the take, a body for any subject in the folder) and
/// Io.
Result<TakeSettings> load_take_settings(const take::TakeReader& take, const OtherFiles& others);

/// Replaces bone lengths and marker offsets of each subject by those of the subject of the same name in `description`,
/// and marks the subject as fitted. Leaves out a subject with other markers or bones, and one whose offsets are equal.
void use_bodies(const Description& description, settings::DaemonSettings& settings);

}  // namespace mocap::retrack
