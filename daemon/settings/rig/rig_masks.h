#pragma once

#include <filesystem>

#include "base/result.h"
#include "model/camera_model.h"

namespace mocap::settings {

/// Writes the `learnt_masks` of `rig` into the rig file, for each camera that both have (by name). Every other byte of
/// the file stays: numbers, comments, keys of other programs. The file is replaced as a whole or, if that fails, not at
/// all.
///
/// Fails with Io, and with InvalidArgument if the file cannot be edited in this way: it is not TOML, or a camera is an
/// inline table `{ ... }`.
Status save_learnt_masks(const std::filesystem::path& path, const Rig& rig);

}  // namespace mocap::settings
