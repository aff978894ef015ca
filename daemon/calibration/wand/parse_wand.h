#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "calibration/wand/wand.h"

namespace mocap::calibration {

/// Checks the positions of the markers of a wand, m: two or three, ascending from 0, and its length. Fails with
/// InvalidArgument.
Result<Wand> wand_of(const std::vector<double>& marks_m);

/// Parses a preset (250, 400 or 500), or the positions of two or three markers in mm: "0,160,500". Fails as wand_of.
Result<Wand> parse_wand(const std::string& text);

}  // namespace mocap::calibration
