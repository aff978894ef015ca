#include "associate/single_view/association_log_odds.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace mocap::associate {
namespace {

const double kLn2Pi = std::log(2.0 * std::numbers::pi);
// Half width of the window of the local clutter density. Chosen by hand; not yet measured.
constexpr double kDensityWindow_px = 40.0;

// The density of other rays that may be clutter, per px^2. `count_assigned`: includes the rays that belong to markers.
double clutter_density_1_px2(const ViewRays& view, std::size_t ray, bool count_assigned) {
  const auto counts = [&](std::size_t other) { return other != ray && (count_assigned || view.use_count[other] == 0); };
  const double about = kDensityWindow_px / view.focal_px;
  double all = 1.0;  // one more than the number of rays, so that the density is never 0
  double near = 0.0;
  for (std::size_t other = 0; other < view.size(); ++other) {
    if (!counts(other)) continue;
    const double dx = std::abs(view.x(other) - view.x(ray)), dy = std::abs(view.y(other) - view.y(ray));
    all += 1.0;
    near += std::max(dx, dy) < about ? 1.0 : 0.0;
  }
  const double image_px2 = static_cast<double>(view.camera->width_px) * static_cast<double>(view.camera->height_px);
  return all / image_px2 + near / (4.0 * kDensityWindow_px * kDensityWindow_px);
}

// The log density of a normal distribution with mean 0.
template <int N>
double log_density(const Eigen::Matrix<double, N, 1>& at, const Eigen::Matrix<double, N, N>& covariance) {
  const Eigen::LLT<Eigen::Matrix<double, N, N>> root(covariance);
  const Eigen::Matrix<double, N, 1> scaled = root.matrixL().solve(at);
  return -0.5 * scaled.squaredNorm() - root.matrixLLT().diagonal().array().log().sum() - 0.5 * N * kLn2Pi;
}

}  // namespace

ViewObservation view_observation(const ViewRays& view, const AssignedRay& assigned, const WorldPoint& point,
                                 double rig_px) {
  const Eigen::Matrix3d& r = view.camera->camera_from_world.rotation;
  const Eigen::Vector3d seen = (view.camera->camera_from_world * point).v;
  const Eigen::Vector2d centre = seen.head<2>() / seen.z();
  ViewObservation pair;
  for (const int axis : {0, 1}) {
    pair.px_from_m.row(axis) = view.focal_px / seen.z() * (r.row(axis) - centre[axis] * r.row(2));
  }
  const bool shared = assigned.sigma_px > 0.0F;
  const Eigen::Vector2d at =
      Eigen::Vector2d(view.x(assigned.ray), view.y(assigned.ray)) + assigned.offset.cast<double>();
  pair.off_px = view.focal_px * (at - centre);
  pair.sigma_px = std::hypot(rig_px, shared ? static_cast<double>(assigned.sigma_px) : view.sigma_px[assigned.ray]);
  pair.clutter_density_1_px2 = clutter_density_1_px2(view, assigned.ray, shared);
  return pair;
}

double pair_log_odds(const ViewObservation& a, const ViewObservation& b, const Eigen::Vector3d& ahead_m,
                     const Eigen::Matrix3d& covariance_m2) {
  Eigen::Matrix<double, 4, 3> px_from_m;
  px_from_m << a.px_from_m, b.px_from_m;
  Eigen::Vector4d off_px;
  off_px << a.off_px, b.off_px;
  off_px -= px_from_m * ahead_m;
  Eigen::Matrix4d covariance = px_from_m * covariance_m2 * px_from_m.transpose();
  covariance.diagonal().head<2>().array() += a.sigma_px * a.sigma_px;
  covariance.diagonal().tail<2>().array() += b.sigma_px * b.sigma_px;
  const double both = log_density<4>(off_px, covariance);
  const double a_alone = log_density<2>(off_px.head<2>(), covariance.topLeftCorner<2, 2>());
  const double b_alone = log_density<2>(off_px.tail<2>(), covariance.bottomRightCorner<2, 2>());
  const double others_a = std::log(a.clutter_density_1_px2), others_b = std::log(b.clutter_density_1_px2);
  return both - std::max({a_alone + others_b, b_alone + others_a, others_a + others_b});
}

double single_view_log_odds(const ViewRays& view, std::size_t ray, const PredictedMarker& predicted, double rig_px) {
  const auto projection = view.projection(predicted.position.v, predicted.covariance_m2);
  if (!projection) return -std::numeric_limits<double>::infinity();
  const Eigen::Vector2d off_px = view.focal_px * (Eigen::Vector2d(view.x(ray), view.y(ray)) - projection->centre);
  Eigen::Matrix2d covariance_px2 = view.focal_px * view.focal_px * projection->covariance;
  covariance_px2.diagonal().array() += rig_px * rig_px + view.sigma_px[ray] * view.sigma_px[ray];
  return log_density<2>(off_px, covariance_px2) - std::log(clutter_density_1_px2(view, ray, false));
}

}  // namespace mocap::associate
