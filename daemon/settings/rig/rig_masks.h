#pragma once

#include <filesystem>

#include "base/result.h"
#include "model/camera_model.h"
#include "settings/rig/mask_kind.h"

namespace mocap::settings {

/// Writes the masks of `kind` of the cameras of `rig` into the rig file, for each camera that both have (by name).
/// Every other byte of the file stays: numbers, comments, keys of other programs. The file is replaced as a whole or,
/// if that fails, not at all.
///
/// Fails with Io, and with InvalidArgument if the file cannot be edited in this way: it is not TOML, or a camera is an
/// inline table `{ ... }`.
Status save_masks(const std::filesystem::path& path, const Rig& rig, const MaskKind& kind);

}  // namespace mocap::settings
