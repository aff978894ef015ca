#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "base/result.h"
#include "calibration/rig/compare_rigs.h"
#include "calibration/rig/judge_rig.h"

namespace mocap::calibrate {

/// What is told about a rig. Borrows evidence and judgement for the call.
struct RigReport {
  std::string title;
  const calibration::RigEvidence& evidence;
  const calibration::RigJudgement& judgement;
  std::optional<calibration::RigChange> since_old = std::nullopt;  ///< against the rig that it replaces
  std::optional<calibration::RigChange> to_truth = std::nullopt;   ///< against a rig that is known to be right
};

/// Lines for a terminal.
std::string report_text(const RigReport& report);

/// One JSON object. Keys: `cameras.<name>.{rms_px,heldout_px,points,coverage,...}`, `wand.{mean_mm,std_mm,min_mm,
/// max_mm}`, `scale_error`, `floor`, `volume`, `grade`, `issues`, and against a truth `position_error_mm`,
/// `rotation_error_deg`. What is not known is null.
std::string report_json(const RigReport& report);

/// One page.
std::string report_svg(const RigReport& report);

/// Writes the report as the file's name ends: .svg, .json, else as text. Fails with Io.
Status write_report(const std::filesystem::path& path, const RigReport& report);

/// What `compare` prints, and its JSON.
std::string change_text(const calibration::RigChange& change);
std::string change_json(const calibration::RigChange& change);

}  // namespace mocap::calibrate
