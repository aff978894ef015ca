#include "stages/view_rays.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/expects.h"
#include "geometry/lens.h"
#include "stages/blob_doubt.h"

namespace mocap::stages {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::uint32_t kNoView = 0xFFFF'FFFF;
// A marker nearer to the camera's plane than that is not in front of it.
constexpr double kNearest_m = 0.05;

double reach_of(const CameraModel& camera) {
  // The rays of the image's border, told at its corners and middles; a wide lens bends the middles out the farthest.
  double reach = 0.0;
  for (const double u : {0.0, 0.5, 1.0}) {
    for (const double v : {0.0, 0.5, 1.0}) {
      const auto ray = geometry::undistort(camera.lens, {{u * camera.width_px - 0.5, v * camera.height_px - 0.5}});
      reach = std::max(reach, ray ? ray->v.norm() : 0.0);
    }
  }
  return 1.05 * reach;
}

}  // namespace

Vector3d ViewRays::direction(std::size_t ray) const {
  return (camera->camera_from_world.rotation.transpose() * Vector3d(x(ray), y(ray), 1.0)).normalized();
}

double ViewRays::off_px(std::size_t ray, const WorldPoint& point) const {
  const Vector3d seen = (camera->camera_from_world * point).v;
  return focal_px * (seen.head<2>() / seen.z() - Vector2d(x(ray), y(ray))).norm();
}

std::optional<Shadow> ViewRays::shadow(const Vector3d& point, const Matrix3d& covariance_m2) const {
  const Matrix3d& r = camera->camera_from_world.rotation;
  const Vector3d seen = r * point + camera->camera_from_world.translation;
  if (!(seen.z() > kNearest_m)) return std::nullopt;
  Shadow shadow;
  const double inverse_z = 1.0 / seen.z();
  shadow.centre = seen.head<2>() * inverse_z;
  Eigen::Matrix<double, 2, 3> slope;
  slope.row(0) = (r.row(0) - shadow.centre.x() * r.row(2)) * inverse_z;
  slope.row(1) = (r.row(1) - shadow.centre.y() * r.row(2)) * inverse_z;
  const Eigen::Matrix<double, 2, 3> spread = slope * covariance_m2;
  shadow.covariance.noalias() = spread * slope.transpose();
  return shadow;
}

double ViewRays::distance2(const Shadow& shadow, std::size_t ray, double floor_px) const {
  const double own = (sigma_px[ray] * sigma_px[ray] + floor_px * floor_px) / (focal_px * focal_px);
  const double xx = shadow.covariance(0, 0) + own;
  const double yy = shadow.covariance(1, 1) + own;
  const double xy = shadow.covariance(0, 1);
  const double dx = rays.x[ray] - shadow.centre.x();
  const double dy = rays.y[ray] - shadow.centre.y();
  return (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy);
}

void ViewRays::index() {
  max_sigma_px_ = max_spread_px_ = 0.0;
  words_ = (size() + 63) / 64;
  bins_ = size() > 2 * 64 ? kMostBins : kMostBins / 2;  // many rays are worth finer bins
  if (size() == 0) return;
  double max_x = min_x_ = rays.x[0];
  double max_y = min_y_ = rays.y[0];
  for (std::size_t ray = 0; ray < size(); ++ray) {
    min_x_ = std::min(min_x_, rays.x[ray]);
    max_x = std::max(max_x, rays.x[ray]);
    min_y_ = std::min(min_y_, rays.y[ray]);
    max_y = std::max(max_y, rays.y[ray]);
    max_sigma_px_ = std::max(max_sigma_px_, sigma_px[ray]);
    max_spread_px_ = std::max(max_spread_px_, spread_px[ray]);
  }
  // The last ray lies in the last bin, not past it.
  constexpr double kAlmost = 1.0 - 1e-9;
  bins_per_x_ = kAlmost * static_cast<double>(bins_) / std::max(1e-9, max_x - min_x_);
  bins_per_y_ = kAlmost * static_cast<double>(bins_) / std::max(1e-9, max_y - min_y_);

  const std::size_t slots = (bins_ + 1) * words_;
  std::fill_n(before_x_.begin(), slots, std::uint64_t{0});
  std::fill_n(before_y_.begin(), slots, std::uint64_t{0});
  for (std::size_t ray = 0; ray < size(); ++ray) {
    const std::uint64_t bit = std::uint64_t{1} << (ray % 64);
    before_x_[(bin_of((rays.x[ray] - min_x_) * bins_per_x_) + 1) * words_ + ray / 64] |= bit;
    before_y_[(bin_of((rays.y[ray] - min_y_) * bins_per_y_) + 1) * words_ + ray / 64] |= bit;
  }
  for (std::size_t slot = words_; slot < slots; ++slot) {
    before_x_[slot] |= before_x_[slot - words_];
    before_y_[slot] |= before_y_[slot - words_];
  }
}

std::optional<std::size_t> ViewRays::nearest_free(const Vector3d& point, const Matrix3d& covariance_m2, double sigmas,
                                                  double floor_px) const {
  const Matrix3d& r = camera->camera_from_world.rotation;
  const Vector3d seen = r * point + camera->camera_from_world.translation;
  if (!(seen.z() > kNearest_m)) return std::nullopt;
  // The shadow is no wider than the point's variance in all axes together, seen aslant at the worst.
  const double inverse_z = 1.0 / seen.z();
  const double at_x = seen.x() * inverse_z;
  const double at_y = seen.y() * inverse_z;
  const double widest = covariance_m2.trace() * inverse_z * inverse_z * (1.0 + at_x * at_x + at_y * at_y);
  const double half = sigmas * std::sqrt(widest + most_own(floor_px));
  std::optional<std::size_t> nearest;
  std::optional<Shadow> exactly;
  double least = sigmas * sigmas;
  near(at_x, at_y, half, half, [&](std::size_t ray) {
    if (taken[ray] != 0 || std::abs(rays.x[ray] - at_x) > half || std::abs(rays.y[ray] - at_y) > half) return;
    if (!exactly) exactly = shadow(point, covariance_m2);
    const double d2 = distance2(*exactly, ray, floor_px);
    if (!(d2 < least)) return;
    least = d2;
    nearest = ray;
  });
  return nearest;
}

RayTable::RayTable(const Rig& rig) : rig_(rig), views_(rig.size()), view_of_(rig.size(), kNoView) {
  MOCAP_EXPECTS(rig.size() <= kMaxCameras);
  for (const CameraModel& camera : rig) {
    casters_.emplace_back(camera);
    rows_.emplace_back(camera.camera_from_world);
    reach_.push_back(reach_of(camera));
  }
  for (ViewRays& view : views_) {
    view.quadric.reserve(kMaxBlobs);
    view.sigma_px.reserve(kMaxBlobs);
    view.spread_px.reserve(kMaxBlobs);
    view.axis.reserve(kMaxBlobs);
    view.blob.reserve(kMaxBlobs);
    view.taken.reserve(kMaxBlobs);
  }
  for (auto* scratch : {&u_px_, &v_px_, &areas_px2_}) scratch->reserve(kMaxBlobs);
}

void RayTable::cast(const FrameSet& frames) {
  MOCAP_EXPECTS(frames.views.size() <= views_.size());
  std::ranges::fill(view_of_, kNoView);
  view_count_ = frames.views.size();
  for (std::size_t view = 0; view < view_count_; ++view) {
    const std::uint32_t camera = frames.views[view]->camera.value;
    MOCAP_EXPECTS(camera < rig_.size());
    view_of_[camera] = static_cast<std::uint32_t>(view);
    cast_view(*frames.views[view], views_[view]);
  }
}

// The middle one of the blobs' areas, where any blob can be a crowd.
double RayTable::usual_area_px2(const BlobFrame& frame) {
  areas_px2_.clear();
  for (const Blob& blob : frame.blobs) areas_px2_.push_back(blob.area_px2);
  if (!may_crowd(areas_px2_)) return std::numeric_limits<double>::infinity();
  const auto middle = areas_px2_.begin() + static_cast<std::ptrdiff_t>(areas_px2_.size() / 2);
  std::ranges::nth_element(areas_px2_, middle);
  return *middle;
}

void RayTable::cast_view(const BlobFrame& frame, ViewRays& view) {
  const std::size_t camera = frame.camera.value;
  view.camera = &rig_[camera];
  view.rows = &rows_[camera];
  view.focal_px = std::sqrt(rig_[camera].lens.fx_px * rig_[camera].lens.fy_px);

  u_px_.resize(frame.blobs.size());
  v_px_.resize(frame.blobs.size());
  for (std::size_t b = 0; b < frame.blobs.size(); ++b) {
    const Blob& blob = frame.blobs.data()[b];
    u_px_[b] = std::isfinite(blob.sigma_px) ? blob.centroid.v.x() : std::numeric_limits<double>::quiet_NaN();
    v_px_[b] = blob.centroid.v.y();
  }
  casters_[camera].cast(u_px_, v_px_, view.rays);
  const double usual_px2 = usual_area_px2(frame);

  view.sigma_px.clear();
  view.spread_px.clear();
  view.axis.clear();
  view.blob.clear();
  for (std::size_t b = 0; b < frame.blobs.size(); ++b) {
    const Blob& blob = frame.blobs.data()[b];
    if (view.rays.exists[b] == 0) continue;
    const double spread = spread_px(blob);
    const bool told = spread > 0.0 && std::isfinite(blob.axis_rad);
    const double crowd = crowd_px(blob, usual_px2);
    const double doubt = doubt_px(blob, spread);
    view.sigma_px.push_back(crowd > 0.0 ? std::hypot(doubt, crowd) : doubt);
    view.spread_px.push_back(spread);
    view.axis.push_back(told ? Vector2d(std::cos(2.0 * blob.axis_rad), std::sin(2.0 * blob.axis_rad))
                             : Vector2d(0.0, 0.0));
    view.blob.push_back(static_cast<std::uint16_t>(b));
  }
  if (view.blob.size() < view.rays.exists.size()) view.rays.drop_missing();
  view.quadric.resize(view.size());
  geometry::quadrics_of(rows_[camera], view.rays, view.sigma_px, view.quadric);
  view.taken.assign(view.size(), 0);
  view.index();
}

std::optional<std::size_t> RayTable::view_of(std::size_t camera) const {
  if (view_of_[camera] == kNoView) return std::nullopt;
  return view_of_[camera];
}

bool RayTable::could_see(std::size_t view, const WorldPoint& point) const {
  const CameraModel& camera = *views_[view].camera;
  const CameraPoint seen = camera.camera_from_world * point;
  if (!(seen.v.z() > 0.0)) return false;
  const NormalizedPoint ray{seen.v.head<2>() / seen.v.z()};
  // Far from the axis the polynomial of the distortion may fold back into the image.
  const double reach = reach_[static_cast<std::size_t>(&camera - rig_.data())];
  return ray.v.norm() <= reach && geometry::in_image(camera, geometry::distort(camera.lens, ray));
}

}  // namespace mocap::stages
