#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "settings/daemon_settings.h"
#include "settings/state_folder.h"

namespace mocap::settings {

/// A file of a configuration under the name that it has in a take: "configuration/mocapd.toml",
/// "state/added_subjects.toml", "rig/hall.toml", "markersets/baseline41.toml", "skeletons/human18.toml", and
/// "subjects/NAME.toml" for the body of the subject NAME.
struct PackedFile {
  std::string name;
  std::string bytes;
};

/// The name in a take of the body of a subject.
std::string name_of_body(const std::string& subject);

/// Reads the files of a configuration as they are now. A file that cannot be read is left out.
std::vector<PackedFile> pack_files(const DaemonSettings& settings);

/// A configuration that was written by unpack_files.
struct UnpackedFiles {
  std::filesystem::path configuration;
  StateFiles state;
};

/// Writes packed files, which may come from an untrusted take, into the empty folder `folder`, so that the
/// configuration can be loaded there: each path in them names the unpacked file. Files with other names are left out.
/// Fails with NotFound if there is no configuration, with InvalidArgument if a file is no TOML file or if two files
/// could be meant by one path, and with Io.
Result<UnpackedFiles> unpack_files(const std::vector<PackedFile>& files, const std::filesystem::path& folder);

}  // namespace mocap::settings
