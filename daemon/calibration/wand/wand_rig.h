#pragma once

#include <optional>
#include <string>

#include "calibration/floor/floor.h"
#include "calibration/wand/rig_before.h"
#include "calibration/wand/solve_wand.h"
#include "model/calibration/calibration_report.h"

namespace mocap::calibration {

/// A rig in its world frame.
struct PlacedRig {
  Rig rig;
  std::optional<Floor> previous_world;  ///< of the rig before; nothing: the cameras were moved
  bool floor_is_guessed = false;        ///< the world frame is provisional, also if it is that of the rig before
};

/// Moves the solution into the world frame of the rig before if its cameras were not moved, else into a provisional
/// one.
PlacedRig place_in_world(const WandSolution& solution, const RigBefore& before);

/// The world frame of a measured floor; nothing if the floor is guessed.
std::optional<Floor> measured_world(const PlacedRig& placed);

/// The reason to refuse a solution whose cameras stand as before at another scale: the length of the wand is wrong.
/// Nothing: the scale is right or cannot be compared.
std::optional<std::string> wrong_scale(const WandSolution& solution, const Rig& before);

/// The facts about a solution for the metadata of a rig file.
RigFacts facts_of(const WandSolution& solution, const PlacedRig& placed);

}  // namespace mocap::calibration
