#pragma once

#include <Eigen/Geometry>

#include "model/camera_model.h"
#include "scene/ring_rig.h"

namespace mocap::test {

inline Rig eight_cameras() {
  return scene::ring_rig(
      {.cameras = 8, .radius_m = 4.0, .height_m = 2.5, .width_px = 1280, .height_px = 1024, .hfov_rad = 1.1});
}

/// Returns the camera rotated by `turn_rad` about an oblique axis of its own frame and translated by `move_m`.
inline CameraModel bumped(CameraModel camera, double turn_rad, double move_m) {
  const Eigen::Vector3d centre = camera.centre().v + move_m * Eigen::Vector3d(0.6, 0.0, 0.8);
  camera.camera_from_world.rotation =
      Eigen::AngleAxisd(turn_rad, Eigen::Vector3d(1.0, 2.0, 0.5).normalized()) * camera.camera_from_world.rotation;
  camera.camera_from_world.translation = -(camera.camera_from_world.rotation * centre);
  return camera;
}

}  // namespace mocap::test
