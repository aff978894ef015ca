#pragma once

#include <filesystem>

#include "base/result.h"
#include "model/camera_model.h"

namespace mocap::settings {

/// Writes the `learnt_masks` of the cameras of `rig` into the rig file, for those of its cameras that `rig` has (by
/// name). All else in the file stays as it is to the byte: numbers, comments, what other programs keep there. The file
/// is replaced as a whole or, when that fails, not at all.
///
/// Fails with InvalidArgument where the file is no rig that could be edited so: not TOML, or a camera that stands in
/// one line in braces.
Status save_learnt_masks(const std::filesystem::path& path, const Rig& rig);

}  // namespace mocap::settings
