#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace mocap {

enum class CalibrationAction {
  Look,     ///< reports the progress
  List,     ///< lists the earlier rigs
  Wand,     ///< collects images of a waved wand
  Solve,    ///< ends the collection and computes the rig
  Apply,    ///< writes the result and uses it
  Cancel,   ///< ends a collection or a solution, and discards the result
  Restore,  ///< uses an earlier rig again
};

/// A request of an operator to calibrate the cameras of the running daemon.
struct CalibrationOrder {
  std::uint64_t number = 0;  ///< of the order, set by the control thread
  CalibrationAction action = CalibrationAction::Look;
  std::vector<double> wand_m;     ///< Wand: distance of each marker from the first: 0, then ascending
  std::optional<double> fov_deg;  ///< Wand: horizontal field of view of all cameras, if their lenses are not calibrated
  bool refine_lens = false;       ///< Wand: estimates the lenses, too, although they are calibrated
  bool moved = false;             ///< Wand: accepts another scale than that of the rig before
  std::string name;               ///< Restore
};

}  // namespace mocap
