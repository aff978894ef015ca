#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "model/camera_model.h"
#include "settings/faults.h"

namespace mocap::calibrate {

/// How other programs write down a calibration.
enum class RigFormat {
  OpenCv,    ///< OpenCV's YAML (FileStorage)
  Kalibr,    ///< Kalibr's camchain YAML
  Pose2Sim,  ///< the TOML of Pose2Sim and aniposelib
  Qca,       ///< Qualisys' .qca.txt (XML); only read
};

/// The formats by the names that the command line has for them; nothing for another word.
std::optional<RigFormat> format_named(std::string_view name);
const char* name_of(RigFormat format);

/// Cameras that were read, and what an operator should know about them.
struct ReadRig {
  Rig rig;
  std::vector<std::string> notices;
};

/// Reads another program's calibration; the format is told by what the file says where none is given. Fails with all
/// that is wrong, each with file, line and value.
Result<ReadRig, settings::Faults> read_rig(const std::filesystem::path& path, std::optional<RigFormat> format);

/// What stands in a file of that format for this rig.
struct RigText {
  std::string text;
  std::vector<std::string> notices;  ///< what the format has no place for
};

/// Fails with Unsupported where a format cannot be written.
Result<RigText> rig_text(const Rig& rig, RigFormat format);

}  // namespace mocap::calibrate
