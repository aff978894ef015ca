#pragma once

#include <optional>

#include "calibration/floor/floor.h"

namespace mocap::calibration {

/// The scale of `rig` relative to `previous` if the cameras of both (in the same order) differ in scale only: 60 % of
/// all distances between two cameras agree on it to 0.5 %. Nothing if cameras were moved, or for fewer than three
/// cameras.
std::optional<double> scale_of_previous(const Rig& rig, const Rig& previous);

/// The world frame of `previous` for `rig`, by a rigid fit to the cameras that were not moved: half of the cameras and
/// at least three, to 10 mm. The orientation of a camera takes part if it is the same to 1 degree; of a camera that was
/// aimed anew, the position only. Nothing if fewer cameras are unmoved, or if they stand on a line, about which the
/// positions do not determine the rotation to 1 degree, and the orientations of fewer than half of the cameras, or than
/// two, are the same. Floor::rms_m is that of the centres.
std::optional<Floor> pose_in_previous_world(const Rig& rig, const Rig& previous);

}  // namespace mocap::calibration
