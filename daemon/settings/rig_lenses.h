#pragma once

#include <filesystem>

#include "base/result.h"
#include "model/camera_model.h"

namespace mocap::settings {

/// Writes the lenses of the cameras of `cameras` into the rig file: `matrix`, `distortions` and `fisheye` of those that
/// it has (by name), and a table of their own for the others. All else in the file stays as it is to the byte. Where
/// there is no such file, one is made. The file is replaced as a whole or, when that fails, not at all.
///
/// Fails with InvalidArgument where the file is no rig that could be edited so: not TOML, a camera that stands in one
/// line in braces, or one of another image size.
Status save_lenses(const std::filesystem::path& path, const Rig& cameras);

}  // namespace mocap::settings
