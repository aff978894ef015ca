#pragma once

#include <filesystem>

#include "calibrate/say.h"
#include "settings/rig_file.h"

namespace mocap::calibrate {

/// Writes a rig with who solved it and when beside `facts`; says so. Gives the program's exit code.
int write_rig(const std::filesystem::path& path, const Rig& rig, settings::RigMetadata facts, const char* solved_by);

}  // namespace mocap::calibrate
