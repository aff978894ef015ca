#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <span>

#include "base/result.h"
#include "geometry/ray_caster.h"
#include "geometry/triangulation.h"

namespace mocap::geometry {

/// A camera's place and attitude by the rows of its 3x4 matrix: what multiplies (X, 1) of a point of the world.
struct CameraRows {
  explicit CameraRows(const CameraFromWorld& camera_from_world);
  CameraRows() = default;

  Eigen::Vector4d x = Eigen::Vector4d::Zero();
  Eigen::Vector4d y = Eigen::Vector4d::Zero();
  Eigen::Vector4d depth = Eigen::Vector4d::Zero();
};

/// What a ray says of the marker it leads to: a point X of the world, `depth` in front of the camera's plane, would be
/// seen sqrt(h^T Q h) / depth standard deviations off the ray, h = (X, 1). Of the symmetric Q, m: xx yy zz 11, then xy
/// yz zx and a number without meaning, then x1 y1 z1 and another.
struct alignas(32) RayQuadric {
  std::array<double, 12> q;
};

/// The quadric of a ray: its squared reprojection error as a form of the point, so that what many rays say of one point
/// is a sum of ten numbers each.
RayQuadric quadric_of(const CameraRows& camera, const Ray& ray, double sigma_px);
/// The same for many rays; as many of `into` are written as there are of `sigma_px`.
void quadrics_of(const CameraRows& camera, const RayColumns& rays, std::span<const double> sigma_px,
                 std::span<RayQuadric> into);

/// One camera's view of a marker.
struct QuadricSighting {
  const RayQuadric* quadric = nullptr;     ///< borrowed for the call
  const Eigen::Vector4d* depth = nullptr;  ///< CameraRows::depth, borrowed for the call
  double sigma_px = 1.0;                   ///< that the quadric was made with
  std::uint32_t source = 0;                ///< the caller's own number for it, carried along
};

/// Finds the point on which most of the sightings agree, as `agree` of sightings does, from a `start` near it.
///
/// With the depths of the start, the sum of squared reprojection errors is a quadratic form of the point, whose least
/// is one 3x3 system away; again (3 times at most) while a depth changes by more than 1 %. What is left differs from
/// the least of the true sum by a share of error over focal length of the standard deviation. While a sighting lies
/// farther off than `agreement` allows, the one without which the others agree best (least sum of squares of what they
/// are off over what they may be) is left out, by taking its part out of the sum. Of more than 8 it is the one farthest
/// off.
///
/// `rms_px` is told to 1 %. Reorders `sightings`: those that agree come first. Fails as `agree` does. Never allocates.
Result<Agreed, TriangulationFailure> agree(std::span<QuadricSighting> sightings, const WorldPoint& start,
                                           const Agreement& agreement);

}  // namespace mocap::geometry
