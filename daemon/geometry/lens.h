#pragma once

#include <optional>

#include "model/camera_model.h"
#include "model/points.h"

namespace mocap::geometry {

/// Where a ray meets the image, distortion done. Never fails: a ray far outside the field of view gives a pixel far
/// outside the image (or one that a real lens would not give: check with `undistort` where that matters).
///
/// Source: the OpenCV documentation, "Camera Calibration and 3D Reconstruction" and "Fisheye camera model".
PixelPoint distort(const Lens& lens, const NormalizedPoint& ray);

/// A pixel, and how it moves when its ray turns a little.
struct DistortedRay {
  PixelPoint pixel;
  Eigen::Matrix2d px_from_ray;  ///< derivative of the pixel by the ray, px
};

/// As `distort`, with the slope.
DistortedRay distort_with_slope(const Lens& lens, const NormalizedPoint& ray);

/// The ray that a pixel sees, distortion undone to 1e-9 of the image plane at distance 1. Nothing where no ray leads
/// to that pixel (outside of what the distortion's polynomial can express).
std::optional<NormalizedPoint> undistort(const Lens& lens, const PixelPoint& pixel);

/// Where a camera sees a point; nothing where the point is not in front of it (nearer than 1 cm to its plane).
std::optional<PixelPoint> project(const CameraModel& camera, const WorldPoint& point);

/// Whether a pixel lies in the camera's image.
bool in_image(const CameraModel& camera, const PixelPoint& pixel);

}  // namespace mocap::geometry
