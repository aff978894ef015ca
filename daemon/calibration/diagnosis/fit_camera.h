#pragma once

#include <optional>
#include <vector>

#include "calibration/diagnosis/camera_views.h"
#include "calibration/diagnosis/consensus_points.h"
#include "model/camera_model.h"

namespace mocap::calibration {

/// The model of a camera whose pose is unknown, from points of other cameras without known correspondences: the
/// rotation by which most rays of its blobs meet points (pairs of rays against pairs of points at the same angle), then
/// rotation and translation by least squares over nearest neighbours. The position in `camera.model` may be wrong by
/// about 10 cm, the rotation by any angle. Nothing without a solution.
std::optional<CameraModel> fit_pose(const CameraViews& camera, const std::vector<std::vector<ConsensusPoint>>& points);

/// The model of a camera whose lens is unknown, with its pose as in `camera.model`: the focal length at which most
/// blobs meet points (between a third and three times that of the model), then focal length, principal point and k1 by
/// least squares over nearest neighbours. Nothing without a solution.
std::optional<CameraModel> fit_focal_length(const CameraViews& camera,
                                            const std::vector<std::vector<ConsensusPoint>>& points);

/// Number of parameters that each fit estimates.
inline constexpr double kPoseParameters = 6.0;
inline constexpr double kLensParameters = 4.0;

}  // namespace mocap::calibration
