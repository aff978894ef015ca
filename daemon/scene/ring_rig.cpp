#include "scene/ring_rig.h"

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <string>

#include "base/expects.h"

namespace mocap::scene {

CameraFromWorld look_at(const Eigen::Vector3d& eye_m, const Eigen::Vector3d& target_m) {
  const Eigen::Vector3d forward = (target_m - eye_m).normalized();
  const Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ()).normalized();
  CameraFromWorld camera_from_world;
  camera_from_world.rotation.row(0) = right.transpose();
  camera_from_world.rotation.row(1) = forward.cross(right).transpose();
  camera_from_world.rotation.row(2) = forward.transpose();
  camera_from_world.translation = -(camera_from_world.rotation * eye_m);
  return camera_from_world;
}

Rig ring_rig(const Ring& ring) {
  MOCAP_EXPECTS(ring.cameras >= 1 && ring.width_px > 0 && ring.height_px > 0);
  MOCAP_EXPECTS(ring.hfov_rad > 0.0 && ring.hfov_rad < std::numbers::pi && ring.radius_m > 0.0);
  const double f_px = 0.5 * ring.width_px / std::tan(0.5 * ring.hfov_rad);

  Rig rig;
  for (int i = 0; i < ring.cameras; ++i) {
    const double angle_rad = 2.0 * std::numbers::pi * (i + 0.5) / ring.cameras;
    const Eigen::Vector3d eye_m(ring.radius_m * std::cos(angle_rad), ring.radius_m * std::sin(angle_rad),
                                ring.height_m);
    CameraModel camera;
    camera.name = "cam" + std::to_string(i + 1);
    camera.width_px = ring.width_px;
    camera.height_px = ring.height_px;
    camera.lens.fx_px = camera.lens.fy_px = f_px;
    camera.lens.cx_px = 0.5 * (ring.width_px - 1);
    camera.lens.cy_px = 0.5 * (ring.height_px - 1);
    camera.camera_from_world = look_at(eye_m, {0.0, 0.0, 1.0});
    rig.push_back(camera);
  }
  return rig;
}

}  // namespace mocap::scene
