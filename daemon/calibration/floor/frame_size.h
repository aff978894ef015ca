#pragma once

#include <optional>
#include <span>

#include "calibration/floor/floor.h"

namespace mocap::calibration {

/// Where no frame of the right size is among the points: how many times larger the only one of its shape is (0.5 to 2;
/// arms in proportion to 1 %, the right angle to 1 degree). Nothing where there is none, or several.
std::optional<double> frame_times_larger(std::span<const Eigen::Vector3d> points_m, const FloorFrame& frame);

}  // namespace mocap::calibration
