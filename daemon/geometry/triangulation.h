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
  double sigma_px = 1.0;                                      ///< standard deviation of each axis; positive
  std::uint32_t source = 0;                                   ///< number chosen by the caller, not used here
};

enum class TriangulationFailure {
  TooFewSightings,
  RaysNearlyParallel,
  BehindACamera,
  Disagreement,  ///< no two sightings agree on a point
};

/// Triangulates one point from n >= 2 sightings by linear least squares.
///
/// Fast and without an initial guess, but the minimised error is algebraic: `refine` the result if sub-pixel noise
/// matters. Never allocates; the cost is linear in n.
///
/// Fails if fewer than two sightings are given, if the rays are nearly parallel (sum of squared angles to the mean
/// direction below 1e-6 rad^2; also two cameras that face each other along one line), or if the point lies behind one
/// of the cameras.
///
/// Source: Hartley and Zisserman, Multiple View Geometry, 2nd ed. (2004), section 12.2, inhomogeneous method.
Result<WorldPoint, TriangulationFailure> triangulate(std::span<const Sighting> sightings);

/// A point with its uncertainty.
struct Refined {
  WorldPoint point;
  Eigen::Matrix3d covariance_m2;  ///< propagated from the sigma_px of the sightings
  double rms_px;                  ///< rms reprojection error of the sightings
};

/// Minimises the sum of squared reprojection errors, each divided by its sigma_px, from `start`: one Gauss-Newton step,
/// and more (3 at most) while a step exceeds 1/100 of the standard deviation.
///
/// Reprojection errors are computed with the derivative of the lens at the sighting, which is exact to second order in
/// the error. Fails like `triangulate`, and with RaysNearlyParallel if the standard deviation of the point exceeds 1 m.
Result<Refined, TriangulationFailure> refine(std::span<const Sighting> sightings, const WorldPoint& start);

/// The distance in the image between the sighting and the projection of `point`, px; infinite if the point is not in
/// front of the camera.
double reprojection_error_px(const Sighting& sighting, const WorldPoint& point);

/// The limit of a sighting's reprojection error: sqrt(floor_px^2 + (sigmas * sigma_px)^2).
struct Agreement {
  double floor_px = 1.0;  ///< calibration error
  double sigmas = 4.0;
};

/// The point on which most sightings agree.
struct Agreed {
  Refined refined;
  std::size_t kept = 0;  ///< number of sightings that agree; these are the first of the span
};

/// Triangulates and refines. While the error of a sighting exceeds its limit (`agreement`), removes one sighting and
/// repeats with the others, down to two: with at most 6 sightings the one without which the others agree best, with
/// more the one with the largest ratio of error to limit. Reorders `sightings`: those that agree come first. Fails like
/// `triangulate`, and with Disagreement.
Result<Agreed, TriangulationFailure> agree(std::span<Sighting> sightings, const Agreement& agreement);

}  // namespace mocap::geometry
