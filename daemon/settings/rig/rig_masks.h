#pragma once

#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "base/result.h"
#include "model/camera_model.h"
#include "settings/rig/mask_kind.h"

namespace mocap::settings {

/// Writes the masks of `kind` of the cameras of `rig` into the rig file, for each camera that both have (by name).
/// Cameras of the file that `rig` lacks keep their masks. Every other byte of the file stays: numbers, comments, keys
/// of other programs. The file is replaced as a whole or, if that fails, not at all.
///
/// Returns the cameras whose masks are not saved, because the file has no table of them. Fails with Io, and with
/// InvalidArgument if the file cannot be edited in this way: it is not TOML, or a camera is an inline table `{ ... }`.
Result<std::vector<std::string>> save_masks(const std::filesystem::path& path, const Rig& rig, const MaskKind& kind);

/// The message about these cameras.
std::string no_place_for_masks(const std::filesystem::path& path, std::span<const std::string> cameras);

}  // namespace mocap::settings
