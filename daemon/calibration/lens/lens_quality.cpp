#include "calibration/lens/lens_quality.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "geometry/lens.h"

namespace mocap::calibration {
namespace {

using Eigen::Vector2d;
using Matrix23 = Eigen::Matrix<double, 2, 3>;
using Matrix29 = Eigen::Matrix<double, 2, kIntrinsicCount>;

constexpr int kFolds = 5;
constexpr int kMaxQualityIterations = 60;
// compensating_rotation() uses every kCornerStride-th corner of each board: enough to sample the covered image area.
constexpr std::size_t kCornerStride = 5;

struct PixelJacobians {
  Matrix23 by_rotation;  // by a rotation of the camera
  Matrix29 by_intrinsics;
};

// Derivatives of the projection of the ray that a pixel has; nothing if the pixel has no ray.
std::optional<PixelJacobians> pixel_jacobians_at(const Lens& lens, const Vector2d& px) {
  const auto ray = geometry::undistort(lens, {px});
  if (!ray) return std::nullopt;
  const double x = ray->v.x();
  const double y = ray->v.y();
  Matrix23 ray_by_rotation;
  ray_by_rotation << x * y, -(1.0 + x * x), y, 1.0 + y * y, -x * y, -x;
  return PixelJacobians{geometry::distort_with_slope(lens, *ray).px_from_ray * ray_by_rotation,
                        pixel_jacobian(lens, ray->v)};
}

// The rotation of the camera that compensates a change of each intrinsic parameter best, by least squares over the
// corners of the boards.
Eigen::Matrix<double, 3, kIntrinsicCount> compensating_rotation(const LensBundle& bundle) {
  Eigen::Matrix3d normal = 1e-9 * Eigen::Matrix3d::Identity();
  Eigen::Matrix<double, 3, kIntrinsicCount> rhs = Eigen::Matrix<double, 3, kIntrinsicCount>::Zero();
  for (const BoardView& view : bundle.views) {
    for (std::size_t i = 0; i < view.seen_px.size(); i += kCornerStride) {
      const auto jacobians = pixel_jacobians_at(bundle.lens, view.seen_px[i]);
      if (!jacobians) continue;
      normal += jacobians->by_rotation.transpose() * jacobians->by_rotation;
      rhs += jacobians->by_rotation.transpose() * jacobians->by_intrinsics;
    }
  }
  return normal.ldlt().solve(rhs);
}

}  // namespace

MappingUncertainty mapping_uncertainty(const LensBundle& bundle, const IntrinsicMatrix& covariance, int width_px,
                                       int height_px, double reach) {
  const Eigen::Matrix<double, 3, kIntrinsicCount> rotation = compensating_rotation(bundle);
  const Vector2d middle(0.5 * (width_px - 1), 0.5 * (height_px - 1));
  const auto sigma_at = [&](const Vector2d& px) {
    const auto jacobians = pixel_jacobians_at(bundle.lens, px);
    if (!jacobians) return std::numeric_limits<double>::infinity();
    const Matrix29 remaining = jacobians->by_intrinsics - jacobians->by_rotation * rotation;
    return std::sqrt(0.5 * (remaining * covariance * remaining.transpose()).trace());
  };
  MappingUncertainty largest;
  for (const double x : {-1.0, 1.0}) {
    for (const double y : {-1.0, 1.0}) {
      const Vector2d corner = middle.cwiseProduct(Vector2d(x, y));
      largest.corner_px = std::max(largest.corner_px, sigma_at(middle + corner));
      largest.rim_px = std::max(largest.rim_px, sigma_at(middle + std::min(1.0, reach) * corner));
    }
  }
  return largest;
}

double cross_validate(const LensBundle& bundle, const IntrinsicMask& parameters) {
  double sum = 0.0;
  std::size_t points = 0;
  for (int fold = 0; fold < kFolds; ++fold) {
    LensBundle train;
    LensBundle test;
    train.lens = bundle.lens;
    for (std::size_t v = 0; v < bundle.views.size(); ++v) {
      LensBundle& part = static_cast<int>(v) % kFolds == fold ? test : train;
      part.views.push_back(bundle.views[v]);
      part.camera_from_board.push_back(bundle.camera_from_board[v]);
    }
    if (test.views.empty()) continue;
    adjust_lens(train, parameters, kMaxQualityIterations);
    test.lens = train.lens;
    const LensResidual residual = refit_board_poses(test);
    sum += residual.sum_px2;
    points += residual.points;
  }
  return points > 0 ? std::sqrt(sum / (2.0 * static_cast<double>(points))) : 0.0;
}

}  // namespace mocap::calibration
