#pragma once

#include <Eigen/Core>

#include "model/camera_model.h"

namespace mocap::scene {

/// Equal cameras on a ring around the volume.
struct Ring {
  int cameras = 4;
  double radius_m = 4.5;
  double height_m = 2.4;
  int width_px = 640;
  int height_px = 480;
  double hfov_rad = 1.134;  ///< 65 degrees: a person who walks within 1.2 m of the centre stays in all images
};

/// The pose of an upright camera at `eye_m` that looks at `target_m`. The direction must not be vertical.
CameraFromWorld look_at(const Eigen::Vector3d& eye_m, const Eigen::Vector3d& target_m);

/// The cameras cam1 to camN: evenly spaced, looking at (0, 0, 1), pinhole cameras without distortion. The first is half
/// a step off the x axis, so that the arms of a T-pose are not along a line of sight. Requires at least one camera,
/// positive sizes and a field of view below pi.
Rig ring_rig(const Ring& ring);

}  // namespace mocap::scene
