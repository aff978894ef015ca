#pragma once

#include <Eigen/Core>
#include <span>

#include "base/result.h"
#include "calibration/floor/floor.h"
#include "model/calibration/calibration_order.h"

namespace mocap::calibration {

/// The floor by the method of the order. `points_m`: stationary markers; for Walk the markers of all instants. Fails as
/// the functions of floor.h; a floor frame of the right shape and another size is named as the reason.
Result<Floor> measure_floor(const FloorOrder& order, std::span<const Eigen::Vector3d> points_m, const Rig& rig);

/// The name of the method in the metadata of a rig file: "frame", "markers" or "walk".
const char* name_of(FloorMethod method) noexcept;

}  // namespace mocap::calibration
