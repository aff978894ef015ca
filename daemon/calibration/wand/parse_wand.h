#pragma once

#include <string>

#include "base/result.h"
#include "calibration/wand/wand.h"

namespace mocap::calibration {

/// Parses a preset (250, 400 or 500), or the positions of two or three markers in mm: "0,160,500".
Result<Wand> parse_wand(const std::string& text);

}  // namespace mocap::calibration
