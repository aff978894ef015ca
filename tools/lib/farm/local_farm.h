#pragma once

#include <cstddef>
#include <vector>

#include "lib/farm/farm_watch.h"
#include "lib/farm/unit.h"

namespace mocap::farm {

/// Runs the units in `jobs` processes of this machine at a time. A unit whose process is ended by a signal (SIGKILL of
/// the kernel without memory, a crash) is begun once more. A unit that fails does not stop the others.
///
/// If `stops` is over 0, no unit is begun, and those that run get SIGTERM, later SIGKILL; what they had written is
/// removed. Returns how many units were never begun.
std::size_t run_here(const std::vector<Unit>& units, const UnitCommand& common, int jobs, const FarmWatch& watch);

/// The processors that this process may use.
int usable_processors();

}  // namespace mocap::farm
