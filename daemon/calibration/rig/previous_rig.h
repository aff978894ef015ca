#pragma once

#include <optional>

#include "calibration/floor/floor.h"

namespace mocap::calibration {

/// The scale of `rig` relative to `previous` if the cameras of both (in the same order) differ in scale only: 60 % of
/// all distances between two cameras agree on it to 0.5 %. Nothing if cameras were moved, or for fewer than three
/// cameras.
std::optional<double> scale_of_previous(const Rig& rig, const Rig& previous);

/// The world frame of `previous` for `rig`, by a rigid fit to the positions and orientations of the cameras that were
/// not moved: half of the cameras and at least three, to 10 mm and 1 degree. The orientations determine the rotation
/// about a line of cameras. Nothing if fewer cameras are unmoved. Floor::rms_m is that of the centres.
std::optional<Floor> pose_in_previous_world(const Rig& rig, const Rig& previous);

}  // namespace mocap::calibration
