#pragma once

#include <optional>
#include <span>

#include "calibration/bundle.h"
#include "model/camera_model.h"

namespace mocap::calibration {

/// A point of the world, and where a camera saw it.
struct KnownSight {
  WorldPoint point;
  PixelPoint at;
  double sigma_px = 0.1;
};

/// A camera, and how well it explains what it saw.
struct FittedCamera {
  CameraModel camera;
  double rms_px = 0.0;  ///< per axis, of those that count
  std::size_t used = 0;
  CameraDoubt doubt;
};

/// Where a camera stands whose lens is known, by points whose places are known, beginning from where it is thought to
/// stand: a few degrees and cm off at most. Sights far off (over 4.5 robust standard deviations) do not count. Nothing
/// for fewer than six sights, or when they do not tell.
std::optional<FittedCamera> place_camera(const CameraModel& start, std::span<const KnownSight> sights);

/// A camera of which nothing but its image's size is known, by points that do not lie in one plane: pose, focal
/// lengths, image centre and distortion. Nothing for fewer than 12 sights, or when they do not tell.
///
/// Source: Hartley and Zisserman, Multiple View Geometry, 2nd ed. (2004), section 7.1, the DLT; then least squares.
std::optional<FittedCamera> fit_camera(const CameraModel& sizes, std::span<const KnownSight> sights);

}  // namespace mocap::calibration
