#include "associate/predicted/batch_triangulator.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/expects.h"
#include "base/loops.h"
#include "geometry/limits.h"

namespace mocap::associate {
namespace {

// A larger displacement, as a share of the depth, makes the weights wrong by more than this share.
constexpr double kMaxRelativeDisplacement = 0.01;

}  // namespace

BatchTriangulator::BatchTriangulator(std::size_t max_markers, std::size_t max_views) {
  const std::size_t lanes = (max_markers + kLanesAtOnce - 1) / kLanesAtOnce * kLanesAtOnce;
  const auto resize = [&](auto&... columns) { (columns.resize(lanes), ...); };
  for (auto& column : start_) resize(column);
  for (auto& column : sum_) resize(column);
  for (auto& column : displacement_) resize(column);
  for (auto& column : covariance_) resize(column);
  resize(is_observable_, count_, min_depth_m_, outlier_count_, sum_px2_, x_, y_, ux_, uy_, vx_, vy_, variance_px2_);
  errors_.resize(max_views * kErrorColumns * lanes);
}

void BatchTriangulator::begin(const Predictions& predicted) {
  marker_count_ = predicted.markers.size();
  lane_count_ = (marker_count_ + kLanesAtOnce - 1) / kLanesAtOnce * kLanesAtOnce;
  view_count_ = 0;
  MOCAP_EXPECTS(lane_count_ <= count_.size());
  for (std::size_t m = 0; m < marker_count_; ++m) {
    const Eigen::Vector3d& at = predicted.markers.data()[m].position.v;
    for (int axis = 0; axis < 3; ++axis) start_[static_cast<std::size_t>(axis)][m] = at[axis];
  }
  for (Floats& column : sum_) std::fill_n(column.begin(), lane_count_, 0.0F);
  std::fill_n(count_.begin(), lane_count_, 0.0F);
  std::fill_n(min_depth_m_.begin(), lane_count_, std::numeric_limits<float>::max());
  std::fill_n(variance_px2_.begin() + static_cast<std::ptrdiff_t>(marker_count_), lane_count_ - marker_count_, 0.0F);
}

// Copies the rays of the view to columns by marker, so that the following loops use SIMD instructions.
void BatchTriangulator::gather(const ViewRays& view, const RayAssignments& assigned) {
  const std::uint32_t* const ray_of = assigned.rays().data();
  const double *x = view.rays.x.data(), *y = view.rays.y.data();
  const float* const sigma_px = view.sigma_f.data();
  double *to_x = x_.data(), *to_y = y_.data();
  float* const to_variance = variance_px2_.data();
  for (std::size_t m = 0; m < marker_count_; ++m) {
    const bool has = ray_of[m] != AssignedRay::kNone;
    const std::size_t ray = has ? ray_of[m] : 0;
    const float sigma = has ? sigma_px[ray] : 0.0F;
    to_x[m] = x[ray];
    to_y[m] = y[ray];
    to_variance[m] = sigma * sigma;
  }
  // A second loop, because the processor has too few registers for all columns in one.
  const double *ux = view.rays.ux.data(), *uy = view.rays.uy.data(), *vx = view.rays.vx.data(),
               *vy = view.rays.vy.data();
  float *to_ux = ux_.data(), *to_uy = uy_.data(), *to_vx = vx_.data(), *to_vy = vy_.data();
  for (std::size_t m = 0; m < marker_count_; ++m) {
    const std::size_t ray = ray_of[m] != AssignedRay::kNone ? ray_of[m] : 0;
    to_ux[m] = static_cast<float>(ux[ray]);
    to_uy[m] = static_cast<float>(uy[ray]);
    to_vx[m] = static_cast<float>(vx[ray]);
    to_vy[m] = static_cast<float>(vy[ray]);
  }
  for (std::size_t i = 0; i < assigned.shared_markers().size(); ++i) {
    const std::uint32_t m = assigned.shared_markers()[i];
    const AssignedRay& shared_place = assigned.shared_places()[i];
    x_[m] += static_cast<double>(shared_place.offset.x());
    y_[m] += static_cast<double>(shared_place.offset.y());
    if (shared_place.sigma_px > 0.0F) variance_px2_[m] = shared_place.sigma_px * shared_place.sigma_px;
  }
}

void BatchTriangulator::add(const ViewRays& view, const RayAssignments& assigned) {
  if (view.size() == 0) {
    std::fill_n(error(view_count_, 0), kErrorColumns * lane_count_, 0.0F);
  } else {
    gather(view, assigned);
    add_gathered(view);
  }
  ++view_count_;
}

MOCAP_WIDE void BatchTriangulator::add_gathered(const ViewRays& view) {
  const auto& [row_x, row_y, row_z] = *view.rows;
  const double r0 = row_x[0], r1 = row_x[1], r2 = row_x[2], t0 = row_x[3];
  const double s0 = row_y[0], s1 = row_y[1], s2 = row_y[2], t1 = row_y[3];
  const double d0 = row_z[0], d1 = row_z[1], d2 = row_z[2], t2 = row_z[3];
  const auto r00 = static_cast<float>(r0), r01 = static_cast<float>(r1), r02 = static_cast<float>(r2);
  const auto r10 = static_cast<float>(s0), r11 = static_cast<float>(s1), r12 = static_cast<float>(s2);
  const auto r20 = static_cast<float>(d0), r21 = static_cast<float>(d1), r22 = static_cast<float>(d2);
  const double *px = start_[0].data(), *py = start_[1].data(), *pz = start_[2].data(), *sx = x_.data(), *sy = y_.data();
  const float *sux = ux_.data(), *suy = uy_.data(), *svx = vx_.data(), *svy = vy_.data(),
              *variance = variance_px2_.data();
  float *xx = sum_[0].data(), *xy = sum_[1].data(), *xz = sum_[2].data(), *yy = sum_[3].data(), *yz = sum_[4].data(),
        *zz = sum_[5].data(), *gx = sum_[6].data(), *gy = sum_[7].data(), *gz = sum_[8].data(),
        *counted = count_.data(), *least_depth = min_depth_m_.data();
  float *at_u = error(view_count_, 0), *u_x = error(view_count_, 1), *u_y = error(view_count_, 2),
        *u_z = error(view_count_, 3), *at_v = error(view_count_, 4), *v_x = error(view_count_, 5),
        *v_y = error(view_count_, 6), *v_z = error(view_count_, 7), *ray_px2 = error(view_count_, 8);
  const std::size_t count = lane_count_ / kLanesAtOnce * kLanesAtOnce;
  MOCAP_INDEPENDENT_TURNS
  for (std::size_t m = 0; m < count; ++m) {
    const bool has_ray = variance[m] > 0.0F;
    const float has = has_ray ? 1.0F : 0.0F;
    const double depth = d0 * px[m] + d1 * py[m] + d2 * pz[m] + t2;
    const double inverse_depth = 1.0 / depth;
    const auto to_x = static_cast<float>((r0 * px[m] + r1 * py[m] + r2 * pz[m] + t0) * inverse_depth - sx[m]);
    const auto to_y = static_cast<float>((s0 * px[m] + s1 * py[m] + s2 * pz[m] + t1) * inverse_depth - sy[m]);
    // A marker without a ray may lie in the plane of the camera: its values are replaced, not multiplied by 0 (NaN).
    const float off_x = has_ray ? to_x : 0.0F, off_y = has_ray ? to_y : 0.0F;
    const float inverse = has_ray ? static_cast<float>(inverse_depth) : 0.0F;
    const auto x = static_cast<float>(sx[m]), y = static_cast<float>(sy[m]);
    const auto depth_m = static_cast<float>(depth);
    const float weight = has / (has_ray ? variance[m] : 1.0F);
    const float ax = (r00 - x * r20) * inverse, ay = (r01 - x * r21) * inverse, az = (r02 - x * r22) * inverse;
    const float bx = (r10 - y * r20) * inverse, by = (r11 - y * r21) * inverse, bz = (r12 - y * r22) * inverse;
    const float ux = sux[m], uy = suy[m], vx = svx[m], vy = svy[m];
    const float u0 = ux * ax + uy * bx, u1 = ux * ay + uy * by, u2 = ux * az + uy * bz;
    const float v0 = vx * ax + vy * bx, v1 = vx * ay + vy * by, v2 = vx * az + vy * bz;
    const float off_u = ux * off_x + uy * off_y, off_v = vx * off_x + vy * off_y;
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
    least_depth[m] = has_ray & (depth_m < least_depth[m]) ? depth_m : least_depth[m];
    at_u[m] = off_u;
    u_x[m] = u0;
    u_y[m] = u1;
    u_z[m] = u2;
    at_v[m] = off_v;
    v_x[m] = v0;
    v_y[m] = v1;
    v_z[m] = v2;
    ray_px2[m] = variance[m];
  }
}

void BatchTriangulator::solve() { solve(0, lane_count_); }

// `first` and `end` are multiples of kLanesAtOnce.
MOCAP_WIDE void BatchTriangulator::solve(std::size_t first, std::size_t end) {
  const float *sxx = sum_[0].data(), *sxy = sum_[1].data(), *sxz = sum_[2].data(), *syy = sum_[3].data(),
              *syz = sum_[4].data(), *szz = sum_[5].data(), *sgx = sum_[6].data(), *sgy = sum_[7].data(),
              *sgz = sum_[8].data();
  const float* least_depth = min_depth_m_.data();
  double *to_x = displacement_[0].data(), *to_y = displacement_[1].data(), *to_z = displacement_[2].data(),
         *observable = is_observable_.data();
  double *cxx = covariance_[0].data(), *cxy = covariance_[1].data(), *cxz = covariance_[2].data(),
         *cyy = covariance_[3].data(), *cyz = covariance_[4].data(), *czz = covariance_[5].data();
  MOCAP_INDEPENDENT_TURNS
  for (std::size_t m = first; m < end; ++m) {
    const double xx = static_cast<double>(sxx[m]), xy = static_cast<double>(sxy[m]), xz = static_cast<double>(sxz[m]);
    const double yy = static_cast<double>(syy[m]), yz = static_cast<double>(syz[m]), zz = static_cast<double>(szz[m]);
    const double gx = static_cast<double>(sgx[m]), gy = static_cast<double>(sgy[m]), gz = static_cast<double>(sgz[m]);
    const double ixx = yy * zz - yz * yz, ixy = xz * yz - xy * zz, ixz = xy * yz - xz * yy;
    const double iyy = xx * zz - xz * xz, iyz = xy * xz - xx * yz, izz = xx * yy - xy * xy;
    const double determinant = xx * ixx + xy * ixy + xz * ixz;
    // The determinant over the sum of the principal minors is a lower bound of the smallest eigenvalue, tight if that
    // eigenvalue is small.
    const double least = geometry::kMinInformation_1_m2 * (ixx + iyy + izz);
    const bool is_observable = (determinant > least) & (determinant > 0.0);
    const double inverse = 1.0 / (is_observable ? determinant : 1.0);
    cxx[m] = ixx * inverse;
    cxy[m] = ixy * inverse;
    cxz[m] = ixz * inverse;
    cyy[m] = iyy * inverse;
    cyz[m] = iyz * inverse;
    czz[m] = izz * inverse;
    const double x = (ixx * gx + ixy * gy + ixz * gz) * inverse;
    const double y = (ixy * gx + iyy * gy + iyz * gz) * inverse;
    const double z = (ixz * gx + iyz * gy + izz * gz) * inverse;
    const auto nearest = static_cast<double>(least_depth[m]);
    const double most = kMaxRelativeDisplacement * nearest;
    observable[m] =
        is_observable & (nearest > geometry::kMinDepth_m) & (x * x + y * y + z * z <= most * most) ? 1.0 : 0.0;
    to_x[m] = x;
    to_y[m] = y;
    to_z[m] = z;
  }
}

MOCAP_WIDE void BatchTriangulator::classify_outliers(const geometry::Agreement& agreement) {
  const auto floor_px2 = static_cast<float>(agreement.floor_px * agreement.floor_px);
  const auto sigmas2 = static_cast<float>(agreement.sigmas * agreement.sigmas);
  const double *to_x = displacement_[0].data(), *to_y = displacement_[1].data(), *to_z = displacement_[2].data();
  float *outliers = outlier_count_.data(), *sum = sum_px2_.data();
  const std::size_t count = lane_count_ / kLanesAtOnce * kLanesAtOnce;
  std::fill_n(outliers, count, 0.0F);
  std::fill_n(sum, count, 0.0F);
  for (std::size_t view = 0; view < view_count_; ++view) {
    const float *at_u = error(view, 0), *u_x = error(view, 1), *u_y = error(view, 2), *u_z = error(view, 3);
    const float *at_v = error(view, 4), *v_x = error(view, 5), *v_y = error(view, 6), *v_z = error(view, 7);
    const float* ray_px2 = error(view, 8);
    MOCAP_INDEPENDENT_TURNS
    for (std::size_t m = 0; m < count; ++m) {
      const auto x = static_cast<float>(to_x[m]), y = static_cast<float>(to_y[m]), z = static_cast<float>(to_z[m]);
      const float u = at_u[m] + u_x[m] * x + u_y[m] * y + u_z[m] * z;
      const float v = at_v[m] + v_x[m] * x + v_y[m] * y + v_z[m] * z;
      const float off_px2 = u * u + v * v;
      outliers[m] += off_px2 <= floor_px2 + sigmas2 * ray_px2[m] ? 0.0F : 1.0F;
      sum[m] += off_px2;
    }
  }
}

geometry::Refined BatchTriangulator::triangulation(std::size_t marker) const {
  geometry::Refined refined;
  for (int axis = 0; axis < 3; ++axis) {
    const auto column = static_cast<std::size_t>(axis);
    refined.point.v[axis] = start_[column][marker] + displacement_[column][marker];
  }
  const auto& c = covariance_;
  refined.covariance_m2 << c[0][marker], c[1][marker], c[2][marker], c[1][marker], c[3][marker], c[4][marker],
      c[2][marker], c[4][marker], c[5][marker];
  refined.rms_px = std::sqrt(static_cast<double>(sum_px2_[marker] / count_[marker]));
  return refined;
}

// Copies the errors of one marker to consecutive memory.
void BatchTriangulator::load_errors(std::size_t marker) {
  for (std::size_t view = 0; view < view_count_; ++view) {
    const float* from = error(view, 0) + marker;
    for (std::size_t column = 0; column < kErrorColumns; ++column)
      loaded_errors_[column][view] = from[column * lane_count_];
  }
}

// The ray with the largest ratio of squared error to its bound.
MOCAP_WIDE BatchTriangulator::Worst BatchTriangulator::worst(std::size_t marker, const geometry::Agreement& agreement) {
  const auto floor_px2 = static_cast<float>(agreement.floor_px * agreement.floor_px);
  const auto sigmas2 = static_cast<float>(agreement.sigmas * agreement.sigmas);
  const auto x = static_cast<float>(displacement_[0][marker]), y = static_cast<float>(displacement_[1][marker]),
             z = static_cast<float>(displacement_[2][marker]);
  const auto& e = loaded_errors_;
  std::array<float, kMaxCameras> off_px2, excess2;
  MOCAP_INDEPENDENT_TURNS
  for (std::size_t view = 0; view < view_count_; ++view) {
    const float u = e[0][view] + e[1][view] * x + e[2][view] * y + e[3][view] * z;
    const float v = e[4][view] + e[5][view] * x + e[6][view] * y + e[7][view] * z;
    off_px2[view] = u * u + v * v;
    excess2[view] = off_px2[view] / (floor_px2 + sigmas2 * e[8][view]);
  }
  Worst worst{0, 0.0F, 0.0F};
  for (std::size_t view = 0; view < view_count_; ++view) {
    worst.sum_px2 += off_px2[view];
    if (excess2[view] <= worst.excess2) continue;
    worst.view = view;
    worst.excess2 = excess2[view];
  }
  return worst;
}

// Adds a ray to the normal equations of its marker (`times` 1) or removes it (`times` -1).
void BatchTriangulator::update_sums(std::size_t marker, std::size_t view, float times) {
  std::array<float, kErrorColumns> e;
  for (std::size_t column = 0; column < kErrorColumns; ++column) e[column] = error(view, column)[marker];
  const auto& [u, ux, uy, uz, v, vx, vy, vz, ray_px2] = e;
  const float weight = times / ray_px2;
  const std::array<float, 9> parts{ux * ux + vx * vx,  ux * uy + vx * vy,  ux * uz + vx * vz,
                                   uy * uy + vy * vy,  uy * uz + vy * vz,  uz * uz + vz * vz,
                                   -(ux * u + vx * v), -(uy * u + vy * v), -(uz * u + vz * v)};
  for (std::size_t i = 0; i < parts.size(); ++i) sum_[i][marker] += weight * parts[i];
  count_[marker] += times;
}

void BatchTriangulator::add_ray(std::size_t marker, std::size_t view, const ViewRays& rays, std::size_t ray) {
  const auto& [row_x, row_y, row_z] = *rays.rows;
  const Eigen::Vector4d at(start_[0][marker], start_[1][marker], start_[2][marker], 1.0);
  const double depth = row_z.dot(at), x = rays.x(ray), y = rays.y(ray);
  const Eigen::Vector4d along_x = (row_x - x * row_z) / depth, along_y = (row_y - y * row_z) / depth;
  const geometry::RayColumns& slope = rays.rays;
  const Eigen::Vector4d u = slope.ux[ray] * along_x + slope.uy[ray] * along_y;
  const Eigen::Vector4d v = slope.vx[ray] * along_x + slope.vy[ray] * along_y;
  const double ray_px2 = rays.sigma_px[ray] * rays.sigma_px[ray];
  const std::array<double, kErrorColumns> e{u.dot(at), u[0], u[1], u[2], v.dot(at), v[0], v[1], v[2], ray_px2};
  for (std::size_t column = 0; column < kErrorColumns; ++column) {
    error(view, column)[marker] = static_cast<float>(e[column]);
  }
  update_sums(marker, view, 1.0F);
  min_depth_m_[marker] = std::min(min_depth_m_[marker], static_cast<float>(depth));
}

std::optional<std::uint64_t> BatchTriangulator::reject_outliers(std::size_t marker,
                                                                const geometry::Agreement& agreement) {
  constexpr float kFew =
      8.0F;  // with so few rays an outlier moves the point so far that a good ray may have the larger error
  std::uint64_t rejected = 0;
  load_errors(marker);
  for (;;) {
    const std::size_t first = marker / kLanesAtOnce * kLanesAtOnce;
    solve(first, first + kLanesAtOnce);
    if (!(is_observable_[marker] > 0.0)) return std::nullopt;
    const Worst far = worst(marker, agreement);
    if (far.excess2 <= 1.0F) {
      outlier_count_[marker] = 0.0F;
      sum_px2_[marker] = far.sum_px2;
      return rejected;
    }
    if (count_[marker] <= kFew) return std::nullopt;
    rejected |= std::uint64_t{1} << far.view;
    update_sums(marker, far.view, -1.0F);
    for (std::size_t column = 0; column < kErrorColumns; ++column) {
      error(far.view, column)[marker] = loaded_errors_[column][far.view] = 0.0F;
    }
  }
}

}  // namespace mocap::associate
