#pragma once

#include <Eigen/Core>
#include <span>
#include <string>

#include "base/result.h"
#include "model/camera_model.h"

namespace mocap::calibration {

/// A floor frame: three markers in an L on the floor. The corner is the origin, the long arm points along x, the short
/// arm along y. A fourth marker may be on the long arm.
struct FloorFrame {
  double long_m = 0.6;
  double short_m = 0.4;
  double height_m = 0.0;  ///< of the marker centres above the floor
};

/// The world frame, relative to the frame of a rig.
struct Floor {
  Pose world_from_rig;
  /// Rms residual of the markers, from the frame or from the plane; of pose_in_previous_world: of the camera centres;
  /// of guess_floor: 0.
  double rms_m = 0.0;
  bool is_checked = true;  ///< false: exactly three markers lie on the plane, which any three do: rms_m says nothing
};

/// Finds the floor frame among stationary points by its arm lengths and its right angle, and fits the world frame to it
/// (Kabsch). Fails with InvalidArgument if the points contain no frame or several, or if the cameras would be below the
/// floor: the rig is then mirrored or upside down, or the arms are exchanged. Time: cubic in the number of points.
Result<Floor> floor_from_frame(std::span<const Eigen::Vector3d> points_m, const FloorFrame& frame, const Rig& rig);

/// Fits the floor plane to three markers or more on the floor; the cameras are above it. The origin is below the mean
/// of the camera centres, x is the projection of the rig's x axis. Fails with InvalidArgument for points on one line,
/// or if they are more than 15 mm rms off one plane; from five markers on, the message names the one without which the
/// others fit a plane best.
Result<Floor> floor_from_points(std::span<const Eigen::Vector3d> points_m, double height_m, const Rig& rig);

/// Fits the floor plane to the lowest points of a walk: the lowest markers of standing feet lie on one plane and no
/// marker is below it. `height_m`: of the centre of the lowest marker above the floor while the foot stands. Fails with
/// InvalidArgument for fewer than 100 points, or if too few of them lie on one plane.
Result<Floor> floor_from_walk(std::span<const Eigen::Vector3d> points_m, double height_m, const Rig& rig);

/// A provisional floor: up is the mean image-up direction of the cameras, and the floor is at the lowest of `points_m`.
Floor guess_floor(std::span<const Eigen::Vector3d> points_m, const Rig& rig);

/// The same cameras with poses in the world frame of `floor`.
Rig in_world(const Floor& floor, const Rig& rig);

}  // namespace mocap::calibration
