#pragma once

#include <filesystem>

#include "calibrate/terminal.h"
#include "settings/rig/rig_file.h"

namespace mocap::calibrate {

/// Writes a rig file with `facts`, the subcommand and the time as its metadata, and reports it. Returns the exit code
/// of the program.
int write_rig(const std::filesystem::path& path, const Rig& rig, settings::RigMetadata facts, const char* subcommand);

}  // namespace mocap::calibrate
