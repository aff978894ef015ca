#pragma once

#include "calibration/wand/solve_wand.h"

namespace mocap::calibration {

/// Lists the residuals of a solution, and asks how well it foretells what it was not told: solves once more, starting
/// from it, without each tenth sample, and looks where these lie in that rig. Fills `residuals` and `heldout_px`.
void hold_out(WandSolution& solution, LensFreedom lens, int threads);

}  // namespace mocap::calibration
