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
  /// A folder with a file NAME.toml for the body of each subject NAME that it replaces.
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

/// Gives the subjects the bodies of a description, as far as it has other ones with the same markers and bones.
void use_bodies(const Description& description, settings::DaemonSettings& settings);

}  // namespace mocap::retrack
