#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>

#include "calibration/floor/floor.h"

namespace mocap::calibration {

/// The size of the only set of points with the shape of `frame`, relative to `frame`: 0.5 to 2, with arms in proportion
/// to 1 % and a right angle to 1 degree. Nothing if there is no such set, or several. Used to explain why
/// floor_from_frame failed: a rig whose scale is wrong.
std::optional<double> floor_frame_scale(std::span<const Eigen::Vector3d> points_m, const FloorFrame& frame);

}  // namespace mocap::calibration
