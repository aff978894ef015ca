#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "base/result.h"
#include "calibration/rig/assess_rig.h"
#include "calibration/rig/compare_rigs.h"

namespace mocap::calibrate {

/// The content of a report about a rig. Borrows evidence and assessment for the call.
struct RigReport {
  std::string title;
  const calibration::RigEvidence& evidence;
  const calibration::RigAssessment& assessment;
  std::optional<calibration::RigChange> since_previous = std::nullopt;  ///< against the previous rig
  std::optional<calibration::RigChange> to_truth = std::nullopt;        ///< against a true rig
};

/// Lines of text.
std::string report_text(const RigReport& report);

/// One JSON object. Keys: `cameras.<name>.{rms_px,heldout_px,points,coverage,...}`, `wand.{mean_mm,std_mm,min_mm,
/// max_mm,mismatch}` (the last: mean over nominal length, minus 1; no evidence of the scale), `floor`, `volume`,
/// `grade`, `issues`, and against a truth `position_error_mm`, `rotation_error_deg`. Unknown figures are null.
std::string report_json(const RigReport& report);

/// One page as SVG.
std::string report_svg(const RigReport& report);

/// Writes the report in the format of the file's suffix: .svg, .json, else text. Fails with Io.
Status write_report(const std::filesystem::path& path, const RigReport& report);

/// The change of a rig as text and as JSON.
std::string change_text(const calibration::RigChange& change);
std::string change_json(const calibration::RigChange& change);

}  // namespace mocap::calibrate
