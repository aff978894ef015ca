#pragma once

#include <vector>

#include "calibration/wand/solve_wand.h"

namespace mocap::calibration {

/// Computes the figures of a WandSolution from an adjusted bundle: residuals, coverage, covariance and wand length of
/// all cameras. The time offsets and the held-out figures stay empty.
WandSolution assess_solution(Bundle bundle, FreeIntrinsics free_intrinsics);

/// The length of the wand (end to end) at each wand pose whose end markers are seen by two cameras or more,
/// triangulated from rays alone, without the known length.
std::vector<double> triangulated_lengths_m(const Bundle& bundle);

/// The positions of the markers along the wand, triangulated from rays alone and scaled to the wand's length: medians
/// over the wand poses. Empty if no wand pose has all its markers in two cameras.
std::vector<double> triangulated_markers_m(const Bundle& bundle);

}  // namespace mocap::calibration
