#pragma once

#include <filesystem>
#include <optional>

#include "calibration/formats/rig_format.h"
#include "settings/faults.h"

namespace mocap::calibrate {

/// Reads a calibration file of another program. Without a format, the content decides (calibration::guess_format).
/// Fails with all faults.
Result<calibration::ParsedRig, settings::Faults> read_rig(const std::filesystem::path& path,
                                                          std::optional<calibration::RigFormat> format);

}  // namespace mocap::calibrate
