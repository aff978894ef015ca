#pragma once

#include <filesystem>

#include "base/result.h"
#include "model/camera_model.h"
#include "settings/rig/mask_kind.h"

namespace mocap::settings {

/// Writes the masks of `kind` of the cameras of `rig` into the rig file, for each camera that both have (by name).
/// Cameras of the file that `rig` lacks keep their masks. Every other byte of the file stays: numbers, comments, keys
/// of other programs. The file is replaced as a whole or, if that fails, not at all.
///
/// Fails with Io, and with InvalidArgument if the file cannot be edited in this way: it is not TOML, a camera is an
/// inline table `{ ... }`, or a camera with masks has no table.
Status save_masks(const std::filesystem::path& path, const Rig& rig, const MaskKind& kind);

}  // namespace mocap::settings
