#pragma once

#include <optional>
#include <span>

#include "calibration/bundle.h"
#include "model/camera_model.h"

namespace mocap::calibration {

/// The image of a point with a known world position.
struct PointObservation {
  WorldPoint point;
  PixelPoint at;
  double sigma_px = 0.1;  ///< standard deviation per axis
};

/// The result of a resection.
struct FittedCamera {
  CameraModel camera;
  double rms_px = 0.0;                         ///< per axis, of the inliers
  std::size_t used = 0;                        ///< number of inliers
  std::optional<PoseUncertainty> uncertainty;  ///< nothing: the observations do not determine the pose
};

/// Resection with known intrinsics: the pose of a camera from points with known positions, by robust least squares from
/// the pose of `start`, which may be wrong by a few degrees and centimetres. Outliers (kOutlierSigmas) are removed.
/// Nothing for fewer than 6 inliers, or if the problem has no solution. Many observations at few places may still leave
/// the pose undetermined: see `uncertainty`.
std::optional<FittedCamera> resect_pose(const CameraModel& start, std::span<const PointObservation> observations);

/// Resection with unknown intrinsics: pose, focal lengths, principal point and distortion from points that are not in
/// one plane. `sizes` gives the image size. Nothing for fewer than 12 inliers, for coplanar points, or if the problem
/// has no solution.
///
/// Source: Hartley and Zisserman, Multiple View Geometry, 2nd ed. (2004), section 7.1 (DLT), refined by least squares.
std::optional<FittedCamera> resect_camera(const CameraModel& sizes, std::span<const PointObservation> observations);

}  // namespace mocap::calibration
