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
  Floor,    ///< measures the floor with the markers that the daemon sees
};

/// How the floor is measured.
enum class FloorMethod {
  Frame,   ///< with a floor frame, which determines the axes, too
  Points,  ///< with three markers or more on the floor
  Walk,    ///< with the lowest markers of a person who walks through the volume
};

struct FloorOrder {
  FloorMethod method = FloorMethod::Frame;
  double long_m = 0.6;    ///< Frame: length of the arm along x
  double short_m = 0.4;   ///< Frame: length of the arm along y
  double height_m = 0.0;  ///< of the centres of the (lowest) markers above the floor
};

/// A request of an operator to calibrate the cameras of the running daemon.
struct CalibrationOrder {
  std::uint64_t number = 0;  ///< of the order, set by the control thread
  CalibrationAction action = CalibrationAction::Look;
  std::vector<double> wand_m;     ///< Wand: distance of each marker from the first: 0, then ascending
  std::optional<double> fov_deg;  ///< Wand: horizontal field of view of the cameras without a calibrated lens
  /// Wand: estimates the lenses, too, although they are calibrated; with `fov_deg`, which is then that of all cameras,
  /// it replaces them.
  bool refine_lens = false;
  bool moved = false;  ///< Wand: accepts another scale than that of the rig before
  std::string name;    ///< Restore
  FloorOrder floor;    ///< Floor
};

}  // namespace mocap
