#pragma once

#include <functional>

#include "calibration/wand/solve_wand.h"

namespace mocap::calibration {

/// Held-out validation of a solution: adjusts the rig again without every tenth sample, starting from the solution, and
/// measures the residuals of those samples in that rig (their wand poses are estimated). Fills `residuals` and the
/// `heldout_px` fields of `solution`; the latter stay empty if an adjustment does not converge. `goes_on`: called in
/// each iteration; after it returned false, the figures have no meaning.
void validate_held_out(WandSolution& solution, FreeIntrinsics free_intrinsics, int threads,
                       const std::function<bool(int)>& goes_on = {});

}  // namespace mocap::calibration
