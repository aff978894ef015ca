#include "geometry/triangulation.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "geometry/limits.h"

namespace mocap::geometry {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// Two rays 0.08 degrees apart: below that, one pixel of noise is metres of depth.
constexpr double kMinRaySpread_rad2 = 1e-6;

// A lower bound of the smallest eigenvalue of a positive semi-definite matrix, tight if that eigenvalue is small:
// determinant over the sum of the principal 2x2 minors.
double least_eigenvalue(const Matrix3d& m) {
  const double minors = m(0, 0) * m(1, 1) - m(0, 1) * m(1, 0) + m(0, 0) * m(2, 2) - m(0, 2) * m(2, 0) +
                        m(1, 1) * m(2, 2) - m(1, 2) * m(2, 1);
  return minors > 0.0 ? m.determinant() / minors : 0.0;
}

// The weighted normal equations of all sightings, linearised at one point.
struct Normal {
  Matrix3d information = Matrix3d::Zero();
  Vector3d gradient = Vector3d::Zero();  // negative gradient of half the sum of squares
  bool in_front = true;
};

Normal linearise(std::span<const Sighting> sightings, const Vector3d& at) {
  Normal normal;
  for (const Sighting& s : sightings) {
    const Matrix3d& r = s.camera_from_world->rotation;
    const Vector3d seen = r * at + s.camera_from_world->translation;
    if (!(seen.z() > kMinDepth_m)) {
      normal.in_front = false;
      return normal;
    }
    const Vector2d ray = seen.head<2>() / seen.z();
    const Matrix2d weight = s.px_from_ray / s.sigma_px;
    const Vector2d error = weight * (s.point.v - ray);
    Eigen::Matrix<double, 2, 3> ray_from_point;
    ray_from_point.row(0) = (r.row(0) - ray.x() * r.row(2)) / seen.z();
    ray_from_point.row(1) = (r.row(1) - ray.y() * r.row(2)) / seen.z();
    const Eigen::Matrix<double, 2, 3> slope = weight * ray_from_point;
    normal.information.noalias() += slope.transpose() * slope;
    normal.gradient.noalias() += slope.transpose() * error;
  }
  return normal;
}

double limit_px(const Sighting& sighting, const Agreement& agreement) {
  return std::hypot(agreement.floor_px, agreement.sigmas * sighting.sigma_px);
}

Result<Refined, TriangulationFailure> solve(std::span<const Sighting> sightings) {
  const auto start = triangulate(sightings);
  if (!start) return start.error();
  return refine(sightings, *start);
}

// The index of the sighting with the largest ratio of error to limit, and that ratio.
std::pair<std::size_t, double> worst_of(std::span<const Sighting> sightings, const WorldPoint& point,
                                        const Agreement& agreement) {
  std::pair<std::size_t, double> worst{0, 0.0};
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    const double excess = reprojection_error_px(sightings[i], point) / limit_px(sightings[i], agreement);
    if (!(excess <= worst.second)) worst = {i, excess};
  }
  return worst;
}

// The sighting without which the others agree best. With few sightings an outlier moves the point so far that another
// sighting may have the larger error, so each sighting is left out in turn.
std::size_t best_left_out(std::span<Sighting> sightings, const Agreement& agreement) {
  std::size_t best = sightings.size() - 1;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < sightings.size(); ++i) {
    std::swap(sightings[i], sightings.back());
    const auto others = sightings.first(sightings.size() - 1);
    if (const auto found = solve(others)) {
      const double excess = worst_of(others, found->point, agreement).second;
      if (excess < least) {
        least = excess;
        best = i;
      }
    }
    std::swap(sightings[i], sightings.back());
  }
  return best;
}

}  // namespace

Result<WorldPoint, TriangulationFailure> triangulate(std::span<const Sighting> sightings) {
  if (sightings.size() < 2) return TriangulationFailure::TooFewSightings;

  // Each image axis of each sighting gives an equation a . X = b for the unknown X; sum up a a^T and a b.
  Matrix3d normal = Matrix3d::Zero();
  Vector3d rhs = Vector3d::Zero();
  for (const Sighting& s : sightings) {
    const Matrix3d& r = s.camera_from_world->rotation;
    const Vector3d& t = s.camera_from_world->translation;
    for (const int axis : {0, 1}) {
      const Vector3d a = (r.row(axis) - s.point.v[axis] * r.row(2)).transpose();
      const double b = s.point.v[axis] * t[2] - t[axis];
      normal.noalias() += a * a.transpose();
      rhs += a * b;
    }
  }

  if (!(least_eigenvalue(normal) > kMinRaySpread_rad2)) return TriangulationFailure::RaysNearlyParallel;

  const WorldPoint found{normal.inverse() * rhs};
  for (const Sighting& s : sightings) {
    const CameraPoint seen = *s.camera_from_world * found;
    if (!(seen.v.z() > kMinDepth_m)) return TriangulationFailure::BehindACamera;
  }
  return found;
}

Result<Refined, TriangulationFailure> refine(std::span<const Sighting> sightings, const WorldPoint& start) {
  constexpr int kMaxSteps = 3;
  constexpr double kSmallStep2 = 1e-4;  // squared standard deviations

  if (sightings.size() < 2) return TriangulationFailure::TooFewSightings;
  Refined refined{start, Matrix3d::Zero(), 0.0};
  for (int step = 0; step < kMaxSteps; ++step) {
    const Normal normal = linearise(sightings, refined.point.v);
    if (!normal.in_front) return TriangulationFailure::BehindACamera;
    if (!(least_eigenvalue(normal.information) > kMinInformation_1_m2)) return TriangulationFailure::RaysNearlyParallel;
    refined.covariance_m2 = normal.information.inverse();
    const Vector3d move = refined.covariance_m2 * normal.gradient;
    refined.point.v += move;
    if (!(move.dot(normal.gradient) > kSmallStep2)) break;
  }

  double sum_of_squares = 0.0;
  for (const Sighting& s : sightings) {
    const double error_px = reprojection_error_px(s, refined.point);
    sum_of_squares += error_px * error_px;
  }
  refined.rms_px = std::sqrt(sum_of_squares / static_cast<double>(sightings.size()));
  if (!std::isfinite(refined.rms_px)) return TriangulationFailure::BehindACamera;
  return refined;
}

double reprojection_error_px(const Sighting& sighting, const WorldPoint& point) {
  const CameraPoint seen = *sighting.camera_from_world * point;
  if (!(seen.v.z() > kMinDepth_m)) return std::numeric_limits<double>::infinity();
  return (sighting.px_from_ray * (seen.v.head<2>() / seen.v.z() - sighting.point.v)).norm();
}

Result<Agreed, TriangulationFailure> agree(std::span<Sighting> sightings, const Agreement& agreement) {
  // With at most this many sightings each one is left out in turn; with more, the outlier has the largest error.
  constexpr std::size_t kFew = 6;

  std::span<Sighting> rest = sightings;
  TriangulationFailure failure = TriangulationFailure::TooFewSightings;
  while (rest.size() >= 2) {
    const auto found = solve(rest);
    std::size_t wrong = rest.size();
    if (found) {
      const auto [index, excess] = worst_of(rest, found->point, agreement);
      if (excess <= 1.0) return Agreed{*found, rest.size()};
      wrong = index;
      failure = TriangulationFailure::Disagreement;
    } else {
      failure = found.error();
    }
    if (rest.size() == 2) break;
    if (!found || rest.size() <= kFew) wrong = best_left_out(rest, agreement);
    std::swap(rest[wrong], rest.back());
    rest = rest.first(rest.size() - 1);
  }
  return failure;
}

}  // namespace mocap::geometry
