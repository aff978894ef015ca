#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "calibration/wand/wand.h"
#include "model/points.h"
#include "model/transform.h"

namespace mocap::calibration {

/// Transforms points of one camera's frame into another camera's frame.
using CameraFromCamera = RigidTransform<CameraPoint, CameraPoint>;

/// The wand in one image: the undistorted rays (x, y, 1) to its markers.
struct WandRays {
  std::array<Eigen::Vector2d, kMaxWandMarkers> ray{};
  bool ends_unknown = false;  ///< the order of the markers may be reversed
};

/// The wand in two images of one instant.
struct WandCorrespondence {
  WandRays a;
  WandRays b;
};

/// Relative pose of two cameras.
struct TwoViewGeometry {
  CameraFromCamera b_from_a;      ///< metric: the scale follows from the wand's length
  int inliers = 0;                ///< correspondences that fit
  double inlier_fraction = 0.0;   ///< of those that were tried
  double median_angle_rad = 0.0;  ///< between the two rays to a marker
};

/// Estimates the relative pose of two cameras: the essential matrix by RANSAC over the five-point method, its
/// decomposition, and the scale from the wand's length. `max_distance`: largest distance of an inlier ray from its
/// epipolar line, on the plane z = 1. At most 400 correspondences are used. Nothing if fewer than 8 fit.
///
/// Sources: Nister, "An efficient solution to the five-point relative pose problem" (2004); Fischler, Bolles, "Random
/// sample consensus" (1981).
std::optional<TwoViewGeometry> estimate_two_view_geometry(const std::vector<WandCorrespondence>& correspondences,
                                                          const Wand& wand, double max_distance);

/// The midpoint of the shortest segment between two rays, in the frame of camera a. Nothing for nearly parallel rays,
/// or if the point is behind one of the cameras.
std::optional<Eigen::Vector3d> triangulate_midpoint(const CameraFromCamera& b_from_a, const Eigen::Vector2d& a,
                                                    const Eigen::Vector2d& b);

}  // namespace mocap::calibration
