#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>

#include "base/result.h"
#include "model/points.h"
#include "model/transform.h"

namespace mocap::geometry {

/// One camera's view of a marker.
struct Sighting {
  const CameraFromWorld* camera_from_world = nullptr;  ///< borrowed for the call
  NormalizedPoint point;
  Eigen::Matrix2d px_from_ray = Eigen::Matrix2d::Identity();  ///< as geometry::Ray has it
  double sigma_px = 1.0;                                      ///< standard deviation of each axis; over 0
  std::uint32_t source = 0;                                   ///< the caller's own number for it, carried along
};

enum class TriangulationFailure {
  TooFewSightings,
  RaysNearlyParallel,
  BehindACamera,
  Disagreement,  ///< no two or more of the sightings look at one point
};

/// Finds the point that all sightings look at.
///
/// Solves the linear equations of n >= 2 sightings by least squares: fast and without a first guess, but what it makes
/// small is an algebraic error. `refine` it when sub-pixel noise matters.
///
/// Fails when fewer than two sightings are given, when the rays differ too little to tell depth (sum of squared angles
/// to their mean direction under 1e-6 rad^2; rays of cameras that face each other along one line too), or when the
/// point lies behind one of the cameras. Never allocates; cost grows with n.
///
/// Source: Hartley and Zisserman, Multiple View Geometry, 2nd ed. (2004), section 12.2, the inhomogeneous method.
Result<WorldPoint, TriangulationFailure> triangulate(std::span<const Sighting> sightings);

/// A point, and how well it is known.
struct Refined {
  WorldPoint point;
  Eigen::Matrix3d covariance_m2;  ///< as the sightings' sigma_px promise it
  double rms_px;                  ///< over the sightings: root of the mean squared distance in the image
};

/// Moves `start` to where the sum of squared reprojection errors, each in its own sigma_px, is least: one Gauss-Newton
/// step, more (3 at most) while a step is over a hundredth of the standard deviation.
///
/// Pixels are told from rays by the slope of the lens at the sighting, which is exact to second order in the error.
/// Fails as `triangulate` does, and with RaysNearlyParallel where the standard deviation of the point is over 1 m.
Result<Refined, TriangulationFailure> refine(std::span<const Sighting> sightings, const WorldPoint& start);

/// How far from the sighting a camera would see `point`, px; infinite where it is not in front of the camera.
double reprojection_error_px(const Sighting& sighting, const WorldPoint& point);

/// How far a sighting may lie from the common point: root of floor_px^2 + (sigmas * sigma_px)^2.
struct Agreement {
  double floor_px = 1.0;  ///< what the calibration may be wrong
  double sigmas = 4.0;
};

/// The point that most of the sightings agree on.
struct Agreed {
  Refined refined;
  std::size_t kept = 0;  ///< that many, at the front of the span, agree
};

/// Triangulates and refines; while a sighting lies farther off than `agreement` allows, leaves out the one without
/// which the others agree best, and tries again with the rest, down to two. Reorders `sightings`: those that agree come
/// first. Fails as `triangulate` does, and with Disagreement.
Result<Agreed, TriangulationFailure> agree(std::span<Sighting> sightings, const Agreement& agreement);

}  // namespace mocap::geometry
