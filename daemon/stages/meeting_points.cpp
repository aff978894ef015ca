#include "stages/meeting_points.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/expects.h"
#include "base/loops.h"

namespace mocap::stages {
namespace {

// Closer to a camera's plane than this is not in front of it.
constexpr double kNearest_m = 0.01;
// Information of a point that is known to 1 m.
constexpr double kLeastInformation_m2 = 1.0;
// Depths that change by more than this share make the weights wrong.
constexpr double kSmallChange = 0.01;

}  // namespace

MeetingPoints::MeetingPoints(std::size_t max_markers, std::size_t max_views)
    : odd_(max_markers), sum_px2_(max_markers), errors_(max_views * kErrorColumns * max_markers) {
  const auto reserve = [&](auto& columns) {
    for (Column& column : columns) column.resize(max_markers);
  };
  reserve(start_);
  reserve(sum_);
  reserve(move_);
  reserve(covariance_);
  for (Column* column : {&told_, &count_, &least_depth_m_, &x_, &y_, &ux_, &uy_, &vx_, &vy_, &variance_px2_}) {
    column->resize(max_markers);
  }
}

void MeetingPoints::begin(const Expected& expected) {
  marker_count_ = expected.markers.size();
  view_count_ = 0;
  MOCAP_EXPECTS(marker_count_ <= count_.size());
  for (std::size_t m = 0; m < marker_count_; ++m) {
    const Eigen::Vector3d& at = expected.markers.data()[m].position.v;
    for (int axis = 0; axis < 3; ++axis) start_[static_cast<std::size_t>(axis)][m] = at[axis];
  }
  for (Column& column : sum_) std::fill_n(column.begin(), marker_count_, 0.0);
  std::fill_n(count_.begin(), marker_count_, 0.0);
  std::fill_n(least_depth_m_.begin(), marker_count_, std::numeric_limits<double>::max());
}

// A column for each number, so that the loops over them run several at a time.
void MeetingPoints::gather(const ViewRays& view, std::span<const Held> held) {
  const geometry::RayColumns& rays = view.rays;
  const double *x = rays.x.data(), *y = rays.y.data(), *sigma_px = view.sigma_px.data();
  const double *ux = rays.ux.data(), *uy = rays.uy.data(), *vx = rays.vx.data(), *vy = rays.vy.data();
  for (std::size_t m = 0; m < marker_count_; ++m) {
    const Held& one = held[m];
    const bool has = one.ray != Held::kNone;
    const std::size_t ray = has ? one.ray : 0;
    const double sigma = one.sigma_px > 0.0F ? static_cast<double>(one.sigma_px) : sigma_px[ray];
    x_[m] = x[ray] + static_cast<double>(one.off.x());
    y_[m] = y[ray] + static_cast<double>(one.off.y());
    ux_[m] = ux[ray];
    uy_[m] = uy[ray];
    vx_[m] = vx[ray];
    vy_[m] = vy[ray];
    variance_px2_[m] = has ? sigma * sigma : 0.0;
  }
}

MOCAP_WIDE void MeetingPoints::add(const ViewRays& view, std::span<const Held> held) {
  if (view.size() == 0) return;
  gather(view, held);
  const auto& [row_x, row_y, row_z] = *view.rows;
  const double r00 = row_x[0], r01 = row_x[1], r02 = row_x[2], t0 = row_x[3];
  const double r10 = row_y[0], r11 = row_y[1], r12 = row_y[2], t1 = row_y[3];
  const double r20 = row_z[0], r21 = row_z[1], r22 = row_z[2], t2 = row_z[3];
  const double *px = start_[0].data(), *py = start_[1].data(), *pz = start_[2].data();
  const double *sx = x_.data(), *sy = y_.data(), *sux = ux_.data(), *suy = uy_.data(), *svx = vx_.data(),
               *svy = vy_.data(), *variance = variance_px2_.data();
  double *xx = sum_[0].data(), *xy = sum_[1].data(), *xz = sum_[2].data(), *yy = sum_[3].data(), *yz = sum_[4].data(),
         *zz = sum_[5].data(), *gx = sum_[6].data(), *gy = sum_[7].data(), *gz = sum_[8].data(),
         *counted = count_.data(), *least_depth = least_depth_m_.data();
  float *at_u = error(view_count_, 0), *u_x = error(view_count_, 1), *u_y = error(view_count_, 2),
        *u_z = error(view_count_, 3), *at_v = error(view_count_, 4), *v_x = error(view_count_, 5),
        *v_y = error(view_count_, 6), *v_z = error(view_count_, 7), *own_px2 = error(view_count_, 8);
  ++view_count_;
  const std::size_t count = marker_count_;
  MOCAP_INDEPENDENT_TURNS
  for (std::size_t m = 0; m < count; ++m) {
    const bool is_held = variance[m] > 0.0;
    const double has = is_held ? 1.0 : 0.0;
    const double depth = r20 * px[m] + r21 * py[m] + r22 * pz[m] + t2;
    // One division tells both reciprocals.
    const double reciprocal = 1.0 / (is_held ? depth * variance[m] : 1.0);
    const double inverse = reciprocal * variance[m];
    const double weight = is_held ? reciprocal * depth : 0.0;
    const double x = sx[m], y = sy[m];
    const double off_x = (r00 * px[m] + r01 * py[m] + r02 * pz[m] + t0) * inverse - x;
    const double off_y = (r10 * px[m] + r11 * py[m] + r12 * pz[m] + t1) * inverse - y;
    const double ax = (r00 - x * r20) * inverse, ay = (r01 - x * r21) * inverse, az = (r02 - x * r22) * inverse;
    const double bx = (r10 - y * r20) * inverse, by = (r11 - y * r21) * inverse, bz = (r12 - y * r22) * inverse;
    const double ux = sux[m], uy = suy[m], vx = svx[m], vy = svy[m];
    const double u0 = ux * ax + uy * bx, u1 = ux * ay + uy * by, u2 = ux * az + uy * bz;
    const double v0 = vx * ax + vy * bx, v1 = vx * ay + vy * by, v2 = vx * az + vy * bz;
    const double off_u = ux * off_x + uy * off_y, off_v = vx * off_x + vy * off_y;
    xx[m] += weight * (u0 * u0 + v0 * v0);
    xy[m] += weight * (u0 * u1 + v0 * v1);
    xz[m] += weight * (u0 * u2 + v0 * v2);
    yy[m] += weight * (u1 * u1 + v1 * v1);
    yz[m] += weight * (u1 * u2 + v1 * v2);
    zz[m] += weight * (u2 * u2 + v2 * v2);
    gx[m] -= weight * (u0 * off_u + v0 * off_v);
    gy[m] -= weight * (u1 * off_u + v1 * off_v);
    gz[m] -= weight * (u2 * off_u + v2 * off_v);
    counted[m] += has;
    least_depth[m] = has > 0.0 && depth < least_depth[m] ? depth : least_depth[m];
    at_u[m] = static_cast<float>(has * off_u);
    u_x[m] = static_cast<float>(has * u0);
    u_y[m] = static_cast<float>(has * u1);
    u_z[m] = static_cast<float>(has * u2);
    at_v[m] = static_cast<float>(has * off_v);
    v_x[m] = static_cast<float>(has * v0);
    v_y[m] = static_cast<float>(has * v1);
    v_z[m] = static_cast<float>(has * v2);
    own_px2[m] = static_cast<float>(variance[m]);
  }
}

MOCAP_WIDE void MeetingPoints::solve() {
  const double *sxx = sum_[0].data(), *sxy = sum_[1].data(), *sxz = sum_[2].data(), *syy = sum_[3].data(),
               *syz = sum_[4].data(), *szz = sum_[5].data(), *gx = sum_[6].data(), *gy = sum_[7].data(),
               *gz = sum_[8].data();
  const double* least_depth = least_depth_m_.data();
  double *to_x = move_[0].data(), *to_y = move_[1].data(), *to_z = move_[2].data(), *told = told_.data();
  double *cxx = covariance_[0].data(), *cxy = covariance_[1].data(), *cxz = covariance_[2].data(),
         *cyy = covariance_[3].data(), *cyz = covariance_[4].data(), *czz = covariance_[5].data();
  const std::size_t count = marker_count_;
  MOCAP_INDEPENDENT_TURNS
  for (std::size_t m = 0; m < count; ++m) {
    const double xx = sxx[m], xy = sxy[m], xz = sxz[m], yy = syy[m], yz = syz[m], zz = szz[m];
    const double ixx = yy * zz - yz * yz, ixy = xz * yz - xy * zz, ixz = xy * yz - xz * yy;
    const double iyy = xx * zz - xz * xz, iyz = xy * xz - xx * yz, izz = xx * yy - xy * xy;
    const double determinant = xx * ixx + xy * ixy + xz * ixz;
    // Determinant over principal minors bounds the least eigenvalue from below, tightly where that one is small.
    const double least = kLeastInformation_m2 * (ixx + iyy + izz);
    const bool is_told = (determinant > least) & (determinant > 0.0);
    const double inverse = 1.0 / (is_told ? determinant : 1.0);
    cxx[m] = ixx * inverse;
    cxy[m] = ixy * inverse;
    cxz[m] = ixz * inverse;
    cyy[m] = iyy * inverse;
    cyz[m] = iyz * inverse;
    czz[m] = izz * inverse;
    const double x = (ixx * gx[m] + ixy * gy[m] + ixz * gz[m]) * inverse;
    const double y = (ixy * gx[m] + iyy * gy[m] + iyz * gz[m]) * inverse;
    const double z = (ixz * gx[m] + iyz * gy[m] + izz * gz[m]) * inverse;
    const double most = kSmallChange * least_depth[m];
    told[m] = is_told & (least_depth[m] > kNearest_m) & (x * x + y * y + z * z <= most * most) ? 1.0 : 0.0;
    to_x[m] = x;
    to_y[m] = y;
    to_z[m] = z;
  }
}

MOCAP_WIDE void MeetingPoints::judge(const geometry::Agreement& agreement) {
  const auto floor_px2 = static_cast<float>(agreement.floor_px * agreement.floor_px);
  const auto sigmas2 = static_cast<float>(agreement.sigmas * agreement.sigmas);
  const double *to_x = move_[0].data(), *to_y = move_[1].data(), *to_z = move_[2].data();
  float *odd = odd_.data(), *sum = sum_px2_.data();
  const std::size_t count = marker_count_;
  std::fill_n(odd, count, 0.0F);
  std::fill_n(sum, count, 0.0F);
  for (std::size_t view = 0; view < view_count_; ++view) {
    const float *at_u = error(view, 0), *u_x = error(view, 1), *u_y = error(view, 2), *u_z = error(view, 3);
    const float *at_v = error(view, 4), *v_x = error(view, 5), *v_y = error(view, 6), *v_z = error(view, 7);
    const float* own_px2 = error(view, 8);
    MOCAP_INDEPENDENT_TURNS
    for (std::size_t m = 0; m < count; ++m) {
      const auto x = static_cast<float>(to_x[m]), y = static_cast<float>(to_y[m]), z = static_cast<float>(to_z[m]);
      const float u = at_u[m] + u_x[m] * x + u_y[m] * y + u_z[m] * z;
      const float v = at_v[m] + v_x[m] * x + v_y[m] * y + v_z[m] * z;
      const float off_px2 = u * u + v * v;
      odd[m] += off_px2 <= floor_px2 + sigmas2 * own_px2[m] ? 0.0F : 1.0F;
      sum[m] += off_px2;
    }
  }
}

geometry::Refined MeetingPoints::meeting(std::size_t marker) const {
  geometry::Refined met;
  for (int axis = 0; axis < 3; ++axis) {
    const auto column = static_cast<std::size_t>(axis);
    met.point.v[axis] = start_[column][marker] + move_[column][marker];
  }
  const auto& c = covariance_;
  met.covariance_m2 << c[0][marker], c[1][marker], c[2][marker], c[1][marker], c[3][marker], c[4][marker], c[2][marker],
      c[4][marker], c[5][marker];
  met.rms_px = std::sqrt(static_cast<double>(sum_px2_[marker]) / count_[marker]);
  return met;
}

}  // namespace mocap::stages
