#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "base/result.h"
#include "model/camera_model.h"
#include "settings/faults.h"
#include "settings/rig/mask_kind.h"

namespace mocap::settings {

/// The files that the daemon itself writes, in a folder of their own, so that it needs no write access to the folder of
/// its configuration. They are read after the configuration. All paths are empty if there is no such folder; the daemon
/// then edits the configuration and the rig file instead.
struct StateFiles {
  std::filesystem::path folder;
  std::filesystem::path added_subjects;  ///< [[subject]] tables, read after those of the configuration
  std::filesystem::path learnt_masks;    ///< replaces the learnt masks of the rig file, camera by camera
  std::filesystem::path drawn_masks;     ///< the same for drawn masks
  std::filesystem::path rig;             ///< the rig of mocapctl calibrate, instead of the rig file

  bool exist() const { return !folder.empty(); }
  /// Whether a file is in the folder.
  bool has(const std::filesystem::path& file) const {
    return exist() && std::filesystem::path(file).lexically_normal().string().starts_with((folder / "").string());
  }
};

/// The files in `folder`; all empty if `folder` is.
StateFiles state_files(const std::filesystem::path& folder);

/// The first folder of $STATE_DIRECTORY, which systemd sets for StateDirectory= (systemd.exec(5)); empty: none.
std::filesystem::path state_folder_of_service();

/// Replaces a path "$CREDENTIALS_DIRECTORY/NAME" by the path of the credential, which systemd provides for
/// LoadCredential= (systemd.exec(5)). Leaves the path as it is if the variable is not set.
std::filesystem::path resolve_credential(const std::filesystem::path& path);

/// Whether the path still begins with $CREDENTIALS_DIRECTORY: no service manager provides the file.
bool is_unresolved_credential(const std::filesystem::path& path);

/// Writes the masks of `kind` of the cameras of `rig`; tables of other cameras stay as they are. The file is replaced
/// as a whole or, if that fails, not at all. Fails with InvalidArgument if there is a file that cannot be read.
Status write_masks(const std::filesystem::path& path, const Rig& rig, const MaskKind& kind);

/// Replaces the masks of `kind` in `rig` by those of the file, for each camera that both have with the same image size.
/// Returns a line for each camera with the reason if its masks were left out. Does nothing if there is no file. Fails
/// with all faults of the file.
Result<std::vector<std::string>, Faults> read_masks(const std::filesystem::path& path, Rig& rig, const MaskKind& kind);

}  // namespace mocap::settings
