#include "stages/view_rays.h"

#include <algorithm>
#include <cmath>

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

geometry::Sighting ViewRays::sighting(std::size_t ray, std::uint32_t source) const {
  return {&camera->camera_from_world, {{x[ray], y[ray]}}, px_from_ray[ray], sigma_px[ray], source};
}

Vector3d ViewRays::direction(std::size_t ray) const {
  return (camera->camera_from_world.rotation.transpose() * Vector3d(x[ray], y[ray], 1.0)).normalized();
}

std::optional<Shadow> ViewRays::shadow(const Vector3d& point, const Matrix3d& covariance_m2) const {
  constexpr double kNearest_m = 0.05;
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
  const double dx = x[ray] - shadow.centre.x();
  const double dy = y[ray] - shadow.centre.y();
  return (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / (xx * yy - xy * xy);
}

std::pair<std::size_t, std::size_t> ViewRays::candidates(const Shadow& shadow, double sigmas, double floor_px) const {
  const double own = (max_sigma_px_ * max_sigma_px_ + floor_px * floor_px) / (focal_px * focal_px);
  const double half = sigmas * std::sqrt(shadow.covariance(0, 0) + own);
  return between(shadow.centre.x() - half, shadow.centre.x() + half);
}

std::pair<std::size_t, std::size_t> ViewRays::between(double low, double high) const {
  if (x.empty()) return {0, 0};
  std::size_t first = first_of_bin_[bin_of(low)];
  while (first < x.size() && x[first] < low) ++first;
  std::size_t last = first;
  while (last < x.size() && x[last] <= high) ++last;
  return {first, last};
}

void ViewRays::index() {
  if (x.empty()) return;
  x_min_ = x.front();
  const double width = x.back() - x.front();
  bins_per_x_ = width > 0.0 ? static_cast<double>(kBins) / width : 0.0;
  std::size_t ray = 0;
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    while (ray < x.size() && bin_of(x[ray]) < bin) ++ray;
    first_of_bin_[bin] = static_cast<std::uint16_t>(ray);
  }
}

std::optional<std::size_t> ViewRays::nearest_free(const Shadow& shadow, double sigmas, double floor_px) const {
  std::optional<std::size_t> nearest;
  double least = sigmas * sigmas;
  const auto [first, last] = candidates(shadow, sigmas, floor_px);
  for (std::size_t ray = first; ray < last; ++ray) {
    if (taken[ray] != 0) continue;
    const double d2 = distance2(shadow, ray, floor_px);
    if (d2 < least) {
      least = d2;
      nearest = ray;
    }
  }
  return nearest;
}

RayTable::RayTable(const Rig& rig) : rig_(rig), views_(rig.size()), view_of_(rig.size(), kNoView) {
  MOCAP_EXPECTS(rig.size() <= kMaxCameras);
  for (const CameraModel& camera : rig) {
    casters_.emplace_back(camera);
    reach_.push_back(reach_of(camera));
  }
  for (ViewRays& view : views_) {
    view.x.reserve(kMaxBlobs);
    view.y.reserve(kMaxBlobs);
    view.px_from_ray.reserve(kMaxBlobs);
    view.sigma_px.reserve(kMaxBlobs);
    view.spread_px.reserve(kMaxBlobs);
    view.axis.reserve(kMaxBlobs);
    view.blob.reserve(kMaxBlobs);
    view.taken.reserve(kMaxBlobs);
  }
  scratch_.reserve(kMaxBlobs);
  areas_.reserve(kMaxBlobs);
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

void RayTable::cast_view(const BlobFrame& frame, ViewRays& rays) {
  const std::size_t camera = frame.camera.value;
  rays.camera = &rig_[camera];
  rays.focal_px = std::sqrt(rig_[camera].lens.fx_px * rig_[camera].lens.fy_px);

  areas_.clear();
  for (const Blob& blob : frame.blobs) areas_.push_back(blob.area_px2);
  const auto middle = areas_.begin() + static_cast<std::ptrdiff_t>(areas_.size() / 2);
  std::ranges::nth_element(areas_, middle);
  const double usual_px2 = areas_.empty() ? 0.0 : *middle;

  scratch_.clear();
  for (std::size_t b = 0; b < frame.blobs.size(); ++b) {
    const Blob& blob = frame.blobs.data()[b];
    if (!blob.centroid.v.allFinite() || !std::isfinite(blob.sigma_px)) continue;
    const auto ray = casters_[camera].cast(blob.centroid);
    if (!ray) continue;
    const double spread = spread_px(blob);
    const bool told = spread > 0.0 && std::isfinite(blob.axis_rad);
    const Vector2d axis =
        told ? Vector2d(std::cos(2.0 * blob.axis_rad), std::sin(2.0 * blob.axis_rad)) : Vector2d(0.0, 0.0);
    const double sigma_px = std::hypot(doubt_px(blob), crowd_px(blob, usual_px2));
    scratch_.push_back({*ray, sigma_px, spread, axis, static_cast<std::uint16_t>(b)});
  }
  std::ranges::sort(scratch_, [](const Cast& a, const Cast& b) {
    const double ax = a.ray.point.v.x();
    const double bx = b.ray.point.v.x();
    return ax < bx || (ax == bx && a.blob < b.blob);
  });

  rays.x.clear();
  rays.y.clear();
  rays.px_from_ray.clear();
  rays.sigma_px.clear();
  rays.spread_px.clear();
  rays.axis.clear();
  rays.blob.clear();
  rays.max_sigma_px_ = 0.0;
  rays.max_spread_px_ = 0.0;
  for (const Cast& cast : scratch_) {
    rays.x.push_back(cast.ray.point.v.x());
    rays.y.push_back(cast.ray.point.v.y());
    rays.px_from_ray.push_back(cast.ray.px_from_ray);
    rays.sigma_px.push_back(cast.sigma_px);
    rays.spread_px.push_back(cast.spread_px);
    rays.axis.push_back(cast.axis);
    rays.blob.push_back(cast.blob);
    rays.max_sigma_px_ = std::max(rays.max_sigma_px_, cast.sigma_px);
    rays.max_spread_px_ = std::max(rays.max_spread_px_, cast.spread_px);
  }
  rays.taken.assign(rays.x.size(), 0);
  rays.index();
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
