#pragma once

#include <Eigen/Core>

namespace mocap {

/// A position in an image, px; origin at the centre of the top-left pixel, x right, y down; with the lens's distortion.
struct PixelPoint {
  Eigen::Vector2d v = Eigen::Vector2d::Zero();
};

/// A viewing ray, as its intersection with the plane z = 1 of the camera frame; no unit, without distortion.
struct NormalizedPoint {
  Eigen::Vector2d v = Eigen::Vector2d::Zero();
};

/// A point in a camera's frame, m; x right, y down, z along the optical axis.
struct CameraPoint {
  Eigen::Vector3d v = Eigen::Vector3d::Zero();
};

/// A point in the capture volume, m; right-handed, z up, floor at z = 0.
struct WorldPoint {
  Eigen::Vector3d v = Eigen::Vector3d::Zero();
};

}  // namespace mocap
