#pragma once

#include <optional>

#include "calibration/floor/floor.h"

namespace mocap::calibration {

/// How many times larger `rig` is than `old`, where their cameras (in the same order) stand alike but for size: most
/// distances between cameras agree on it to 0.5 %. Nothing where cameras were moved, or for fewer than three.
std::optional<double> times_larger(const Rig& rig, const Rig& old);

/// How `rig` lies in the world of `old`, by the cameras that stand where they stood (half of them and three at least,
/// to 10 mm). Nothing where there are not so many.
std::optional<Floor> floor_of_old(const Rig& rig, const Rig& old);

}  // namespace mocap::calibration
