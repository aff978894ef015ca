#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "settings/faults.h"

namespace mocap::settings {

/// The text of a file that somebody keeps by hand; 16 MB at most, where a rig of 64 cameras has 40 kB.
Result<std::string, Fault> read_text(const std::filesystem::path& path);

}  // namespace mocap::settings
