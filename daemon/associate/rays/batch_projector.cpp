#include "associate/rays/batch_projector.h"

#include <cmath>

#include "associate/rays/view_rays.h"
#include "base/loops.h"

namespace mocap::associate {

void BatchProjector::place(std::size_t view, const ViewRays& rays) {
  const auto& [x, y, depth] = *rays.rows;
  for (int i = 0; i < 4; ++i) {
    const auto column = static_cast<std::size_t>(i);
    rows_[column][view] = static_cast<float>(x[i]);
    rows_[4 + column][view] = static_cast<float>(y[i]);
    rows_[8 + column][view] = static_cast<float>(depth[i]);
  }
  const RayBins::Scale& scale = rays.listed().scale();
  min_x_[view] = scale.min_x;
  min_y_[view] = scale.min_y;
  per_x_[view] = scale.per_x;
  per_y_[view] = scale.per_y;
  last_bin_[view] = scale.bins;
  plane_from_px_[view] = static_cast<float>(1.0 / rays.focal_px);
  typical_variance_[view] = rays.typical_variance();
}

MOCAP_WIDE void BatchProjector::cast(const Point& point, std::size_t view_count) {
  const Eigen::Vector3f at = point.at.cast<float>();
  const Eigen::Matrix3f spread = point.covariance_m2.cast<float>();
  const float px = at.x(), py = at.y(), pz = at.z();
  const float cxx = spread(0, 0), cxy = spread(0, 1), cxz = spread(0, 2);
  const float cyy = spread(1, 1), cyz = spread(1, 2), czz = spread(2, 2);
  const auto sigmas = static_cast<float>(point.sigmas);
  const auto floor_px = static_cast<float>(point.floor_px);
  constexpr float kRounding = RayBins::kRounding;
  gate2_ = sigmas * sigmas;
  const std::size_t count = (view_count + kLanes / 2 - 1) / (kLanes / 2) * (kLanes / 2);
  MOCAP_INDEPENDENT_TURNS
  for (std::size_t v = 0; v < count; ++v) {
    const float r00 = rows_[0][v], r01 = rows_[1][v], r02 = rows_[2][v];
    const float r10 = rows_[4][v], r11 = rows_[5][v], r12 = rows_[6][v];
    const float r20 = rows_[8][v], r21 = rows_[9][v], r22 = rows_[10][v];
    const float depth = r20 * px + r21 * py + r22 * pz + rows_[11][v];
    const float inverse = 1.0F / depth;
    const float x = (r00 * px + r01 * py + r02 * pz + rows_[3][v]) * inverse;
    const float y = (r10 * px + r11 * py + r12 * pz + rows_[7][v]) * inverse;
    const float ax = (r00 - x * r20) * inverse, ay = (r01 - x * r21) * inverse, az = (r02 - x * r22) * inverse;
    const float bx = (r10 - y * r20) * inverse, by = (r11 - y * r21) * inverse, bz = (r12 - y * r22) * inverse;
    const float cax = cxx * ax + cxy * ay + cxz * az;
    const float cay = cxy * ax + cyy * ay + cyz * az;
    const float caz = cxz * ax + cyz * ay + czz * az;
    const float cbx = cxx * bx + cxy * by + cxz * bz;
    const float cby = cxy * bx + cyy * by + cyz * bz;
    const float cbz = cxz * bx + cyz * by + czz * bz;
    const float floor = floor_px * plane_from_px_[v];
    const float xx = ax * cax + ay * cay + az * caz + floor * floor;
    const float yy = bx * cbx + by * cby + bz * cbz + floor * floor;
    x_[v] = x;
    y_[v] = y;
    xx_[v] = xx;
    xy_[v] = bx * cax + by * cay + bz * caz;
    yy_[v] = yy;
    depth_m_[v] = depth;
    const float half_x = sigmas * std::sqrt(xx + typical_variance_[v]);
    const float half_y = sigmas * std::sqrt(yy + typical_variance_[v]);
    const float last = last_bin_[v];
    const auto bin = [last](float to) {
      const float low = to > 0.0F ? to : 0.0F;
      return static_cast<std::int32_t>(low < last ? low : last);
    };
    left_[v] = bin((x - half_x - min_x_[v]) * per_x_[v] - kRounding);
    right_[v] = bin((x + half_x - min_x_[v]) * per_x_[v] + kRounding + 1.0F);
    top_[v] = bin((y - half_y - min_y_[v]) * per_y_[v] - kRounding);
    bottom_[v] = bin((y + half_y - min_y_[v]) * per_y_[v] + kRounding + 1.0F);
  }
}

std::optional<std::size_t> BatchProjector::nearest_unassigned(std::size_t view, const ViewRays& rays) const {
  if (!(depth_m_[view] > kMinDepthSingle_m)) return std::nullopt;
  const RayBins::Gate gate{static_cast<std::size_t>(left_[view]), static_cast<std::size_t>(right_[view]),
                           static_cast<std::size_t>(top_[view]), static_cast<std::size_t>(bottom_[view])};
  const float x = x_[view], y = y_[view], xy = xy_[view];
  float least = gate2_;
  std::optional<std::size_t> nearest;
  rays.listed().visit(gate, [&](std::size_t ray, const ListedRays::Place& at) {
    const float dx = at.x - x;
    const float dy = at.y - y;
    const float xx = xx_[view] + at.variance;
    const float yy = yy_[view] + at.variance;
    const float distance2 = (yy * dx * dx - 2.0F * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy);
    if (!(distance2 < least) || rays.use_count[ray] != 0) return;
    least = distance2;
    nearest = ray;
  });
  return nearest;
}

}  // namespace mocap::associate
