#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "settings/faults.h"

namespace mocap::settings {

/// Reads the text of a settings file of at most 16 MB (a rig of 64 cameras has 40 kB).
Result<std::string, Fault> read_text(const std::filesystem::path& path);

}  // namespace mocap::settings
