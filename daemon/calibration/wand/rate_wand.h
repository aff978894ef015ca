#pragma once

#include "calibration/wand/solve_wand.h"

namespace mocap::calibration {

/// How good a solution is, camera by camera, and what the wand's length says; all but the cameras' time.
WandSolution rate_wand(Bundle bundle, LensFreedom lens);

/// The wand's length, end to end, at each place where two cameras see both ends: by rays alone, not told how long it
/// is.
std::vector<double> wand_lengths_m(const Bundle& bundle);

/// Where the markers are along the wand, by rays alone but for its whole length, which is as told: medians over its
/// places. Empty where no place has all markers in two cameras.
std::vector<double> measured_marks_m(const Bundle& bundle);

}  // namespace mocap::calibration
