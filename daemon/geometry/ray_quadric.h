#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>

#include "base/result.h"
#include "geometry/ray_caster.h"
#include "geometry/triangulation.h"

namespace mocap::geometry {

/// The pose of a camera as the three rows of the 3x4 matrix that maps (X, 1), X in the world, to the camera.
struct CameraRows {
  explicit CameraRows(const CameraFromWorld& camera_from_world);
  CameraRows() = default;

  Eigen::Vector4d x = Eigen::Vector4d::Zero();
  Eigen::Vector4d y = Eigen::Vector4d::Zero();
  Eigen::Vector4d depth = Eigen::Vector4d::Zero();
};

/// The squared reprojection error of a ray as a quadratic form of the point. A point X of the world at depth d projects
/// sqrt(h^T Q h) / d standard deviations from the ray, with h = (X, 1). The array has the elements of the symmetric
/// matrix Q (lengths in m): xx yy zz 11, xy yz zx and an unused number, x1 y1 z1 and an unused number.
struct alignas(32) RayQuadric {
  std::array<double, 12> q;
};

/// The quadric of a ray. The squared errors of many rays for one point are the sum of their quadrics, ten numbers each.
RayQuadric quadric_of(const CameraRows& camera, const Ray& ray, double sigma_px);
/// The same for many rays; writes one element of `into` for each element of `sigma_px`.
void quadrics_of(const CameraRows& camera, const RayColumns& rays, std::span<const double> sigma_px,
                 std::span<RayQuadric> into);

/// One camera's view of a marker.
struct QuadricSighting {
  const RayQuadric* quadric = nullptr;     ///< borrowed for the call
  const Eigen::Vector4d* depth = nullptr;  ///< CameraRows::depth, borrowed for the call
  double sigma_px = 1.0;                   ///< the standard deviation with which the quadric was made
  std::uint32_t source = 0;                ///< number chosen by the caller, not used here
};

/// Finds the point on which most sightings agree, like `agree` for `Sighting`, from a `start` near the point.
///
/// With the depths of `start`, the sum of squared reprojection errors is a quadratic form of the point, and its minimum
/// is the solution of one 3x3 system. The step is repeated (3 times at most) while a depth changes by more than 1 %.
/// The result differs from the minimum of the true sum by error over focal length, in standard deviations.
///
/// While the error of a sighting exceeds its limit (`agreement`), one sighting is removed from the sum (downdating):
/// with at most 8 sightings the one without which the sum of squared errors over squared limits is least, with more the
/// one with the largest ratio of error to limit.
///
/// `rms_px` is accurate to 1 %. Reorders `sightings`: those that agree come first. Fails like `agree`. Never allocates.
Result<Agreed, TriangulationFailure> agree(std::span<QuadricSighting> sightings, const WorldPoint& start,
                                           const Agreement& agreement);

}  // namespace mocap::geometry
