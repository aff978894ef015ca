#pragma once

#include <Eigen/Core>
#include <span>
#include <string>

#include "base/result.h"
#include "model/camera_model.h"

namespace mocap::calibration {

/// Three markers in an L that lies on the floor: the corner is the origin, the long arm points along x, the short one
/// along y. A fourth may lie on the long arm.
struct FloorFrame {
  double long_m = 0.6;
  double short_m = 0.4;
  double height_m = 0.0;  ///< of the markers' centres over the floor
};

/// Where the world is, and how well what was seen fits it.
struct Floor {
  Pose world_from_rig;
  double rms_m = 0.0;  ///< of the markers from the frame, or from the plane
};

/// Finds the frame among points that lie still, by its two arms and the right angle between them, and lays the world on
/// it. Refuses points that hold no such frame or several, and a frame under which the cameras stand: then the rig is
/// mirrored or upside down, or the arms are exchanged.
Result<Floor> floor_by_frame(std::span<const Eigen::Vector3d> points_m, const FloorFrame& frame, const Rig& rig);

/// The plane of three or more markers on the floor; the cameras are above it. Origin: under the middle of the
/// cameras; x: as level as may be along the rig's own x. Refuses points on one line.
Result<Floor> floor_by_points(std::span<const Eigen::Vector3d> points_m, double height_m, const Rig& rig);

/// The plane that a walk's markers never go below: most of the lowest points of feet lie on it. `height_m`: of the
/// lowest marker's centre over the floor when a foot stands.
Result<Floor> floor_by_walk(std::span<const Eigen::Vector3d> points_m, double height_m, const Rig& rig);

/// A guess until the floor is measured: up is where the tops of most images look, and the floor lies under the lowest
/// of `points_m` (of what moved in the volume).
Floor floor_by_guess(std::span<const Eigen::Vector3d> points_m, const Rig& rig);

/// The same cameras, in the world that `floor` lays out.
Rig laid_on(const Floor& floor, const Rig& rig);

}  // namespace mocap::calibration
