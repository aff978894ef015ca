#include "stages/meeting_points.h"

#include <cmath>

#include "base/expects.h"
#include "base/loops.h"

namespace mocap::stages {
namespace {

// Closer to a camera's plane than this is not in front of it.
constexpr double kNearest_m = 0.01;
// Information of a point that is known to 1 m.
constexpr double kLeastInformation_m2 = 1.0;
// Depths that change by more make the weights wrong.
constexpr double kSmallChange = 0.01;

}  // namespace

MeetingPoints::MeetingPoints(std::size_t max_markers) {
  for (auto& column : start_) column.resize(max_markers);
  for (auto& column : sum_) column.resize(max_markers);
  for (auto& column : point_) column.resize(max_markers);
  for (auto& column : covariance_) column.resize(max_markers);
  for (auto* column :
       {&told_, &odd_, &sum2_px_, &count_, &x_, &y_, &ux_, &uy_, &vx_, &vy_, &variance_px2_, &allowed_px2_}) {
    column->resize(max_markers);
  }
}

void MeetingPoints::begin(const Expected& expected) {
  marker_count_ = expected.markers.size();
  MOCAP_EXPECTS(marker_count_ <= count_.size());
  for (std::size_t m = 0; m < marker_count_; ++m) {
    const Eigen::Vector3d& at = expected.markers.data()[m].position.v;
    for (int axis = 0; axis < 3; ++axis) start_[static_cast<std::size_t>(axis)][m] = at[axis];
  }
  const auto clear = [this](Column& column) { std::fill_n(column.begin(), marker_count_, 0.0); };
  for (Column& column : sum_) clear(column);
  for (Column* column : {&odd_, &sum2_px_, &count_}) clear(*column);
}

// A column for each number, so that the loops over them run several at a time.
void MeetingPoints::gather(const ViewRays& view, std::span<const Held> held, const geometry::Agreement& agreement) {
  const double floor_px2 = agreement.floor_px * agreement.floor_px;
  const double sigmas2 = agreement.sigmas * agreement.sigmas;
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
    allowed_px2_[m] = floor_px2 + sigmas2 * sigma * sigma;
  }
}

MOCAP_WIDE void MeetingPoints::add(const ViewRays& view, std::span<const Held> held) {
  if (view.size() == 0) return;
  gather(view, held, {});
  const auto& [row_x, row_y, row_z] = *view.rows;
  const double r00 = row_x[0], r01 = row_x[1], r02 = row_x[2], t0 = row_x[3];
  const double r10 = row_y[0], r11 = row_y[1], r12 = row_y[2], t1 = row_y[3];
  const double r20 = row_z[0], r21 = row_z[1], r22 = row_z[2], t2 = row_z[3];
  const double *px = start_[0].data(), *py = start_[1].data(), *pz = start_[2].data();
  const double *sx = x_.data(), *sy = y_.data(), *sux = ux_.data(), *suy = uy_.data(), *svx = vx_.data(),
               *svy = vy_.data(), *variance = variance_px2_.data();
  double *xx = sum_[0].data(), *xy = sum_[1].data(), *xz = sum_[2].data(), *yy = sum_[3].data(), *yz = sum_[4].data(),
         *zz = sum_[5].data(), *gx = sum_[6].data(), *gy = sum_[7].data(), *gz = sum_[8].data(),
         *counted = count_.data();
  const std::size_t count = marker_count_;
  MOCAP_INDEPENDENT_TURNS
  for (std::size_t m = 0; m < count; ++m) {
    const double has = variance[m] > 0.0 ? 1.0 : 0.0;
    const double depth = r20 * px[m] + r21 * py[m] + r22 * pz[m] + t2;
    const double inverse = 1.0 / (has > 0.0 ? depth : 1.0);
    const double weight = has / (variance[m] > 0.0 ? variance[m] : 1.0);
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
  }
}

MOCAP_WIDE void MeetingPoints::solve() {
  const double *sxx = sum_[0].data(), *sxy = sum_[1].data(), *sxz = sum_[2].data(), *syy = sum_[3].data(),
               *syz = sum_[4].data(), *szz = sum_[5].data(), *gx = sum_[6].data(), *gy = sum_[7].data(),
               *gz = sum_[8].data();
  const double *start_x = start_[0].data(), *start_y = start_[1].data(), *start_z = start_[2].data();
  double *px = point_[0].data(), *py = point_[1].data(), *pz = point_[2].data(), *told = told_.data();
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
    told[m] = is_told ? 1.0 : 0.0;
    cxx[m] = ixx * inverse;
    cxy[m] = ixy * inverse;
    cxz[m] = ixz * inverse;
    cyy[m] = iyy * inverse;
    cyz[m] = iyz * inverse;
    czz[m] = izz * inverse;
    px[m] = start_x[m] + (ixx * gx[m] + ixy * gy[m] + ixz * gz[m]) * inverse;
    py[m] = start_y[m] + (ixy * gx[m] + iyy * gy[m] + iyz * gz[m]) * inverse;
    pz[m] = start_z[m] + (ixz * gx[m] + iyz * gy[m] + izz * gz[m]) * inverse;
  }
}

MOCAP_WIDE void MeetingPoints::judge(const ViewRays& view, std::span<const Held> held,
                                     const geometry::Agreement& agreement) {
  if (view.size() == 0) return;
  gather(view, held, agreement);
  const auto& [row_x, row_y, row_z] = *view.rows;
  const double r00 = row_x[0], r01 = row_x[1], r02 = row_x[2], t0 = row_x[3];
  const double r10 = row_y[0], r11 = row_y[1], r12 = row_y[2], t1 = row_y[3];
  const double r20 = row_z[0], r21 = row_z[1], r22 = row_z[2], t2 = row_z[3];
  const double *start_x = start_[0].data(), *start_y = start_[1].data(), *start_z = start_[2].data();
  const double *px = point_[0].data(), *py = point_[1].data(), *pz = point_[2].data();
  const double *sx = x_.data(), *sy = y_.data(), *sux = ux_.data(), *suy = uy_.data(), *svx = vx_.data(),
               *svy = vy_.data(), *variance = variance_px2_.data(), *allowed = allowed_px2_.data();
  double *odd = odd_.data(), *sum2 = sum2_px_.data();
  const std::size_t count = marker_count_;
  MOCAP_INDEPENDENT_TURNS
  for (std::size_t m = 0; m < count; ++m) {
    const bool has = variance[m] > 0.0;
    const double before = r20 * start_x[m] + r21 * start_y[m] + r22 * start_z[m] + t2;
    const double depth = r20 * px[m] + r21 * py[m] + r22 * pz[m] + t2;
    const double inverse = 1.0 / (has ? depth : 1.0);
    const double off_x = (r00 * px[m] + r01 * py[m] + r02 * pz[m] + t0) * inverse - sx[m];
    const double off_y = (r10 * px[m] + r11 * py[m] + r12 * pz[m] + t1) * inverse - sy[m];
    const double off_u = sux[m] * off_x + suy[m] * off_y, off_v = svx[m] * off_x + svy[m] * off_y;
    const double off2 = off_u * off_u + off_v * off_v;
    const bool fits = (depth > kNearest_m) & (before > kNearest_m) & (off2 <= allowed[m]) &
                      (std::abs(depth - before) <= kSmallChange * before);
    odd[m] += has & !fits ? 1.0 : 0.0;
    sum2[m] += has ? off2 : 0.0;
  }
}

geometry::Refined MeetingPoints::meeting(std::size_t marker) const {
  geometry::Refined met;
  met.point.v = {point_[0][marker], point_[1][marker], point_[2][marker]};
  const auto& c = covariance_;
  met.covariance_m2 << c[0][marker], c[1][marker], c[2][marker], c[1][marker], c[3][marker], c[4][marker], c[2][marker],
      c[4][marker], c[5][marker];
  met.rms_px = std::sqrt(sum2_px_[marker] / count_[marker]);
  return met;
}

}  // namespace mocap::stages
