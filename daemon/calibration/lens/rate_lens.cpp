#include "calibration/lens/rate_lens.h"

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
using Matrix29 = Eigen::Matrix<double, 2, kLensParts>;

constexpr int kFolds = 5;
constexpr int kManySteps = 60;
// Of the corners of each board, one in so many tells where boards were.
constexpr std::size_t kEach = 5;

struct Slopes {
  Matrix23 by_turn;  // of the camera
  Matrix29 by_lens;
};

// How a pixel moves; nothing where the lens has no ray.
std::optional<Slopes> slopes_at(const Lens& lens, const Vector2d& px) {
  const auto ray = geometry::undistort(lens, {px});
  if (!ray) return std::nullopt;
  const double x = ray->v.x();
  const double y = ray->v.y();
  Matrix23 ray_by_turn;
  ray_by_turn << x * y, -(1.0 + x * x), y, 1.0 + y * y, -x * y, -x;
  return Slopes{geometry::distort_with_slope(lens, *ray).px_from_ray * ray_by_turn, pixel_by_lens(lens, ray->v)};
}

// By which turn of the camera a change of the lens is made up for, where boards were.
Eigen::Matrix<double, 3, kLensParts> turn_by_lens(const LensBundle& bundle) {
  Eigen::Matrix3d normal = 1e-9 * Eigen::Matrix3d::Identity();
  Eigen::Matrix<double, 3, kLensParts> rhs = Eigen::Matrix<double, 3, kLensParts>::Zero();
  for (const BoardView& view : bundle.views) {
    for (std::size_t i = 0; i < view.seen_px.size(); i += kEach) {
      const auto slope = slopes_at(bundle.lens, view.seen_px[i]);
      if (!slope) continue;
      normal += slope->by_turn.transpose() * slope->by_turn;
      rhs += slope->by_turn.transpose() * slope->by_lens;
    }
  }
  return normal.ldlt().solve(rhs);
}

}  // namespace

MappingSigma rate_mapping(const LensBundle& bundle, const LensMatrix& covariance, int width_px, int height_px,
                          double reach) {
  const Eigen::Matrix<double, 3, kLensParts> turn = turn_by_lens(bundle);
  const Vector2d middle(0.5 * (width_px - 1), 0.5 * (height_px - 1));
  const auto sigma_at = [&](const Vector2d& px) {
    const auto slope = slopes_at(bundle.lens, px);
    if (!slope) return std::numeric_limits<double>::infinity();  // where the polynomial has no ray, nothing is known
    const Matrix29 left = slope->by_lens - slope->by_turn * turn;
    return std::sqrt(0.5 * (left * covariance * left.transpose()).trace());
  };
  MappingSigma worst;
  for (const double x : {-1.0, 1.0}) {
    for (const double y : {-1.0, 1.0}) {
      const Vector2d corner = middle.cwiseProduct(Vector2d(x, y));
      worst.corner_px = std::max(worst.corner_px, sigma_at(middle + corner));
      worst.rim_px = std::max(worst.rim_px, sigma_at(middle + std::min(1.0, reach) * corner));
    }
  }
  return worst;
}

double leave_some_out(const LensBundle& bundle, const LensParts& parts) {
  double sum = 0.0;
  std::size_t points = 0;
  for (int fold = 0; fold < kFolds; ++fold) {
    LensBundle train;
    LensBundle test;
    train.lens = bundle.lens;
    for (std::size_t v = 0; v < bundle.views.size(); ++v) {
      LensBundle& side = static_cast<int>(v) % kFolds == fold ? test : train;
      side.views.push_back(bundle.views[v]);
      side.camera_from_board.push_back(bundle.camera_from_board[v]);
    }
    if (test.views.empty()) continue;
    adjust_lens(train, parts, kManySteps);
    test.lens = train.lens;
    const LensResidue residue = place_boards(test);
    sum += residue.sum_px2;
    points += residue.points;
  }
  return points > 0 ? std::sqrt(sum / (2.0 * static_cast<double>(points))) : 0.0;
}

}  // namespace mocap::calibration
