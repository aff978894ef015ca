#pragma once

#include "model/camera_model.h"

namespace mocap::scene {

/// Cameras on a ring around the volume, all of one make.
struct Ring {
  int cameras = 4;
  double radius_m = 4.5;
  double height_m = 2.4;
  int width_px = 640;
  int height_px = 480;
  double hfov_rad = 1.134;  ///< 65 degrees: a person who walks within 1.2 m of the centre stays in all images
};

/// Looks from `eye_m` at `target_m`, upright: the image's down axis leans towards the floor.
CameraFromWorld look_at(const Eigen::Vector3d& eye_m, const Eigen::Vector3d& target_m);

/// The cameras cam1 to camN, evenly spaced, looking at (0, 0, 1), pinholes without distortion. The first stands half a
/// step off the x axis, so that nobody in a T-pose stretches the arms along a line of sight. Needs at least one camera,
/// positive sizes and an angle under pi.
Rig ring_rig(const Ring& ring);

}  // namespace mocap::scene
