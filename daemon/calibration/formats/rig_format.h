#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "model/camera_model.h"

namespace mocap::calibration {

/// File formats of other programs for the calibration of cameras.
enum class RigFormat {
  OpenCv,    ///< OpenCV's YAML (FileStorage)
  Kalibr,    ///< Kalibr's camchain YAML
  Pose2Sim,  ///< the TOML of Pose2Sim and aniposelib; settings::load_foreign_rig reads it
  Qca,       ///< Qualisys' .qca.txt (XML); read only
};

/// The format with this name on the command line; nothing for another word.
std::optional<RigFormat> format_named(std::string_view name);
const char* name_of(RigFormat format);

/// The format that the text is in, by its first character and its keys; nothing if it is in none of them.
std::optional<RigFormat> guess_format(const std::string& text);

/// A fault of a text and its place.
struct FormatFault {
  std::uint32_t line = 0;    ///< from 1; 0: the whole text
  std::uint32_t column = 0;  ///< from 1
  std::string message;       ///< names the camera, the value and what was expected
};
using FormatFaults = std::vector<FormatFault>;

/// The cameras of a text, and notices for the operator.
struct ParsedRig {
  Rig rig;
  std::vector<std::string> notices;
};

/// Parses a rig in the format OpenCv, Kalibr or Qca; Pose2Sim is a precondition failure. `default_name`: of a camera
/// without a name (OpenCV's files of a single camera). Fails with all faults.
Result<ParsedRig, FormatFaults> parse_rig(RigFormat format, const std::string& text, const std::string& default_name);

/// A rig as text in a format of another program.
struct RigText {
  std::string text;
  std::vector<std::string> notices;  ///< properties of the rig that the format cannot represent
};

/// Fails with Unsupported for Qca.
Result<RigText> rig_text(const Rig& rig, RigFormat format);

}  // namespace mocap::calibration
