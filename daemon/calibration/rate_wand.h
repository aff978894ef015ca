#pragma once

#include "calibration/solve_wand.h"

namespace mocap::calibration {

/// How good a solution is, camera by camera, and what the wand's length says; all but the cameras' time.
WandSolution rate_wand(Bundle bundle, LensFreedom lens);

}  // namespace mocap::calibration
