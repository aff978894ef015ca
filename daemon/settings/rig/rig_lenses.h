#pragma once

#include <filesystem>

#include "base/result.h"
#include "model/camera_model.h"

namespace mocap::settings {

/// Writes the lenses of `cameras` into the rig file: `matrix`, `distortions` and `fisheye` of each camera that the file
/// has (by name), and a new table for each other camera. Every other byte of the file stays. The file is created if
/// there is none. It is replaced as a whole or, if that fails, not at all.
///
/// Fails with Io, and with InvalidArgument if the file cannot be edited in this way: it is not TOML, or a camera is an
/// inline table `{ ... }` or has another image size.
Status save_lenses(const std::filesystem::path& path, const Rig& cameras);

}  // namespace mocap::settings
