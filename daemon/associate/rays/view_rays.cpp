#include "associate/rays/view_rays.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "associate/rays/centroid_uncertainty.h"
#include "base/expects.h"
#include "base/loops.h"
#include "geometry/lens.h"

namespace mocap::associate {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// The largest distance from the axis, on the image plane at distance 1, of a ray of the image, with a margin of 5 %.
double max_ray_norm(const CameraModel& camera) {
  // The corners and the middles of the borders are sampled: a barrel distortion moves the middles outward the most.
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

Vector2d ViewRays::axis(std::size_t ray) const {
  if (!(spread_px[ray] > 0.0) || !std::isfinite(axis_rad[ray])) return Vector2d::Zero();
  // Single precision suffices: the axis of a blob is known to a thousandth at best.
  const auto twice = static_cast<float>(2.0 * axis_rad[ray]);
  return {static_cast<double>(std::cos(twice)), static_cast<double>(std::sin(twice))};
}

Vector3d ViewRays::direction(std::size_t ray) const {
  return (camera->camera_from_world.rotation.transpose() * Vector3d(x(ray), y(ray), 1.0)).normalized();
}

double ViewRays::off_px(std::size_t ray, const WorldPoint& point) const {
  const Vector3d seen = (camera->camera_from_world * point).v;
  return focal_px * (seen.head<2>() / seen.z() - Vector2d(x(ray), y(ray))).norm();
}

std::optional<ProjectedGaussian> ViewRays::projection(const Vector3d& point, const Matrix3d& covariance_m2) const {
  const Matrix3d& r = camera->camera_from_world.rotation;
  const Vector3d seen = r * point + camera->camera_from_world.translation;
  if (!(seen.z() > kMinDepth_m)) return std::nullopt;
  ProjectedGaussian projection;
  const double inverse_z = 1.0 / seen.z();
  projection.centre = seen.head<2>() * inverse_z;
  Eigen::Matrix<double, 2, 3> slope;
  slope.row(0) = (r.row(0) - projection.centre.x() * r.row(2)) * inverse_z;
  slope.row(1) = (r.row(1) - projection.centre.y() * r.row(2)) * inverse_z;
  const Eigen::Matrix<double, 2, 3> spread = slope * covariance_m2;
  projection.covariance.noalias() = spread * slope.transpose();
  return projection;
}

void ViewRays::write_quadric(std::size_t ray) {
  quadric[ray] = geometry::quadric_of(*rows, rays[ray], sigma_px[ray]);
  has_quadric_[ray] = 1;
}

void ViewRays::make_all_quadrics() {
  geometry::quadrics_of(*rows, rays, sigma_px, quadric);
  std::ranges::fill(has_quadric_, std::uint8_t{1});
}

void ViewRays::index() {
  // `for_each_unassigned` reads eight counters at once: the counters past the last ray are not zero.
  std::fill_n(use_count.begin(), size(), std::uint8_t{0});
  std::fill_n(use_count.begin() + static_cast<std::ptrdiff_t>(size()), std::min<std::size_t>(8, kMaxBlobs - size()),
              std::uint8_t{1});
  has_quadric_.assign(size(), 0);
  quadric.resize(size());
  listed_.clear();
  max_spread_px_ = 0.0;
  bounds_ = {};
  if (size() > 0) bound();
}

void ViewRays::list_unassigned(float sigmas) {
  listed_.clear();
  if (unassigned_count() == size()) {
    listed_.add_all(places());
  } else {
    for_each_unassigned([this](std::size_t ray) { listed_.add(ray, place(ray)); });
  }
  listed_.bin(bounds_, typical_variance(), sigmas);
}

namespace {

// The minimum and the maximum of many numbers, in eight independent chains so that the compiler uses SIMD instructions.
struct Range {
  static constexpr std::size_t kLanes = 8;
  std::array<float, kLanes> least, most;

  explicit Range(float first) {
    least.fill(first);
    most.fill(first);
  }
  [[gnu::always_inline]] void include(std::size_t lane, float value) {
    least[lane] = value < least[lane] ? value : least[lane];
    most[lane] = value > most[lane] ? value : most[lane];
  }
  // Pairwise reduction without branches.
  float min() const {
    std::array<float, kLanes> left = least;
    for (std::size_t half = kLanes / 2; half > 0; half /= 2) {
      for (std::size_t i = 0; i < half; ++i) left[i] = left[i + half] < left[i] ? left[i + half] : left[i];
    }
    return left[0];
  }
  float max() const {
    std::array<float, kLanes> left = most;
    for (std::size_t half = kLanes / 2; half > 0; half /= 2) {
      for (std::size_t i = 0; i < half; ++i) left[i] = left[i + half] > left[i] ? left[i + half] : left[i];
    }
    return left[0];
  }
};

}  // namespace

// Computes the bounds of all rays and copies their numbers in single precision.
MOCAP_WIDE void ViewRays::bound() {
  const std::size_t count = size();
  for (auto* column : {&x_f, &y_f, &variance_f, &sigma_f}) column->resize(count);
  const auto px2 = static_cast<float>(1.0 / (focal_px * focal_px));
  const double *x = rays.x.data(), *y = rays.y.data(), *sigma = sigma_px.data(), *spread = spread_px.data();
  float *to_x = x_f.data(), *to_y = y_f.data(), *to_variance = variance_f.data(), *to_sigma = sigma_f.data();
  Range of_x(static_cast<float>(x[0])), of_y(static_cast<float>(y[0])), of_variance(0.0F), of_spread(0.0F);
  const auto include = [&](std::size_t i, std::size_t lane) __attribute__((always_inline)) {
    to_x[i] = static_cast<float>(x[i]);
    to_y[i] = static_cast<float>(y[i]);
    to_sigma[i] = static_cast<float>(sigma[i]);
    to_variance[i] = to_sigma[i] * to_sigma[i] * px2;
    of_x.include(lane, to_x[i]);
    of_y.include(lane, to_y[i]);
    of_variance.include(lane, to_variance[i]);
    of_spread.include(lane, static_cast<float>(spread[i]));
  };
  const std::size_t whole = count / Range::kLanes * Range::kLanes;
  for (std::size_t first = 0; first < whole; first += Range::kLanes) {
    MOCAP_INDEPENDENT_TURNS
    for (std::size_t lane = 0; lane < Range::kLanes; ++lane) include(first + lane, lane);
  }
  for (std::size_t i = whole; i < count; ++i) include(i, i - whole);
  bounds_ = {of_x.min(), of_x.max(), of_y.min(), of_y.max(), of_variance.max()};
  // The rounding to single precision may have decreased the maximum.
  max_spread_px_ = 1.000001 * static_cast<double>(of_spread.max());
}

RayTable::RayTable(const Rig& rig) : rig_(rig), views_(rig.size()), view_of_(rig.size(), kNoView) {
  MOCAP_EXPECTS(rig.size() <= kMaxCameras);
  for (const CameraModel& camera : rig) {
    casters_.emplace_back(camera);
    rows_.emplace_back(camera.camera_from_world);
    max_ray_norm_.push_back(max_ray_norm(camera));
  }
  for (ViewRays& view : views_) view.reserve();
  for (auto* scratch : {&u_px_, &v_px_, &areas_px2_}) scratch->resize(kMaxBlobs);
}

void ViewRays::reserve() {
  quadric.reserve(kMaxBlobs);
  blob.reserve(kMaxBlobs);
  track.reserve(kMaxBlobs);
  for (auto* column : {&sigma_px, &spread_px, &axis_rad}) column->reserve(kMaxBlobs);
  for (auto* column : {&x_f, &y_f, &variance_f, &sigma_f}) column->reserve(kMaxBlobs);
  has_quadric_.reserve(kMaxBlobs);
}

void RayTable::begin(const FrameSet& frames) {
  MOCAP_EXPECTS(frames.views.size() <= views_.size());
  std::ranges::fill(view_of_, kNoView);
  view_count_ = frames.views.size();
  for (std::size_t view = 0; view < view_count_; ++view) {
    const std::uint32_t camera = frames.views[view]->camera.value;
    MOCAP_EXPECTS(camera < rig_.size());
    view_of_[camera] = static_cast<std::uint32_t>(view);
    frames_[view] = frames.views[view];
  }
}

void RayTable::cast(std::size_t view) { cast_rays(*frames_[view], views_[view]); }

void RayTable::list_unassigned(double sigmas) {
  for (std::size_t view = 0; view < view_count_; ++view) {
    views_[view].list_unassigned(static_cast<float>(sigmas));
    projector_.place(view, views_[view]);
  }
}

void RayTable::cast_rays(const BlobFrame& frame, ViewRays& view) {
  const std::size_t camera = frame.camera.value;
  const std::size_t count = frame.blobs.size();
  view.camera = &rig_[camera];
  view.rows = &rows_[camera];
  view.focal_px = std::sqrt(rig_[camera].lens.fx_px * rig_[camera].lens.fy_px);

  const bool crowds = prepare_blobs(frame, view);
  casters_[camera].cast({u_px_.data(), count}, {v_px_.data(), count}, view.rays);
  if (crowds) inflate_crowd_sigma(frame, view);
  view.drop_missing();
  view.index();
}

// Copies the properties of the blobs except their rays. Returns whether any blob may be a crowd of markers.
bool RayTable::prepare_blobs(const BlobFrame& frame, ViewRays& view) {
  const std::size_t count = frame.blobs.size();
  view.sigma_px.resize(count);
  view.spread_px.resize(count);
  view.axis_rad.resize(count);
  view.blob.resize(count);
  view.track.resize(count);
  bool any_track = false;
  double least_px2 = std::numeric_limits<double>::infinity();
  double most_px2 = 0.0;
  for (std::size_t b = 0; b < count; ++b) {
    const Blob& blob = frame.blobs.data()[b];
    u_px_[b] = std::isfinite(blob.sigma_px) ? blob.centroid.v.x() : std::numeric_limits<double>::quiet_NaN();
    v_px_[b] = blob.centroid.v.y();
    least_px2 = std::min(least_px2, blob.area_px2);
    most_px2 = std::max(most_px2, blob.area_px2);
    view.blob[b] = static_cast<std::uint16_t>(b);
    view.track[b] = blob.track;
    any_track |= blob.track.names_something();
    const double spread = is_round(blob) ? 0.0 : spread_px(blob);
    view.spread_px[b] = spread;
    view.sigma_px[b] = centroid_sigma_px(blob, spread);
    view.axis_rad[b] = blob.axis_rad;
  }
  view.any_track = any_track;
  return may_contain_crowd(least_px2, most_px2);
}

// Increases the uncertainty of blobs that are much larger than the median blob.
void RayTable::inflate_crowd_sigma(const BlobFrame& frame, ViewRays& view) {
  for (std::size_t b = 0; b < frame.blobs.size(); ++b) areas_px2_[b] = frame.blobs.data()[b].area_px2;
  const auto end = areas_px2_.begin() + static_cast<std::ptrdiff_t>(frame.blobs.size());
  const auto middle = areas_px2_.begin() + static_cast<std::ptrdiff_t>(frame.blobs.size() / 2);
  std::nth_element(areas_px2_.begin(), middle, end);
  for (std::size_t b = 0; b < frame.blobs.size(); ++b) {
    const double crowd = crowd_offset_px(frame.blobs.data()[b], *middle);
    if (crowd > 0.0) view.sigma_px[b] = std::hypot(view.sigma_px[b], crowd);
  }
}

// Removes the blobs without a ray.
void ViewRays::drop_missing() {
  const auto& exists = rays.exists;
  if (std::ranges::find(exists, 0) == exists.end()) return;
  std::size_t count_left = 0;
  for (std::size_t b = 0; b < exists.size(); ++b) {
    if (exists[b] == 0) continue;
    sigma_px[count_left] = sigma_px[b];
    spread_px[count_left] = spread_px[b];
    axis_rad[count_left] = axis_rad[b];
    track[count_left] = track[b];
    blob[count_left++] = blob[b];
  }
  sigma_px.resize(count_left);
  spread_px.resize(count_left);
  axis_rad.resize(count_left);
  blob.resize(count_left);
  track.resize(count_left);
  rays.drop_missing();
}

bool RayTable::is_in_image(std::size_t view, const WorldPoint& point) const {
  const CameraModel& camera = *views_[view].camera;
  const CameraPoint seen = camera.camera_from_world * point;
  if (!(seen.v.z() > 0.0)) return false;
  const NormalizedPoint ray{seen.v.head<2>() / seen.v.z()};
  // Far from the axis the distortion polynomial may fold back into the image.
  const double reach = max_ray_norm_[static_cast<std::size_t>(&camera - rig_.data())];
  return ray.v.norm() <= reach && geometry::in_image(camera, geometry::distort(camera.lens, ray));
}

}  // namespace mocap::associate
