#pragma once

#include <Eigen/Core>
#include <optional>

#include "model/camera_model.h"
#include "model/points.h"

namespace mocap::geometry {

/// The pixel of a ray, with lens distortion. Never fails: a ray far outside the field of view gives a pixel far outside
/// the image, or a pixel that the real lens would not give. Where the difference matters, check with `undistort`.
///
/// Source: the OpenCV documentation, "Camera Calibration and 3D Reconstruction" and "Fisheye camera model".
PixelPoint distort(const Lens& lens, const NormalizedPoint& ray);

/// A pixel, and its derivative by the ray.
struct DistortedRay {
  PixelPoint pixel;
  Eigen::Matrix2d px_from_ray;  ///< derivative of the pixel by the ray, px
};

/// The same as `distort`, with the derivative.
DistortedRay distort_with_slope(const Lens& lens, const NormalizedPoint& ray);

/// The ray of a pixel, to 1e-9 on the image plane at distance 1. Nothing if no ray maps to the pixel: the pixel is
/// outside the range of the distortion polynomial.
std::optional<NormalizedPoint> undistort(const Lens& lens, const PixelPoint& pixel);

/// The pixel of a point; nothing if the point is less than 1 cm in front of the camera.
std::optional<PixelPoint> project(const CameraModel& camera, const WorldPoint& point);

/// Whether a pixel lies inside the image of the camera.
bool in_image(const CameraModel& camera, const PixelPoint& pixel);

}  // namespace mocap::geometry
