#include "lib/simworld/points_world.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "geometry/lens.h"
#include "scene/ring_rig.h"

namespace mocap::simworld {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr int kWidth_px = 1280;
constexpr int kHeight_px = 1024;
constexpr double kHalfField_rad = 0.567;  // horizontal field of view: 65 degrees
// Discs merge if the gap between them is at most one pixel.
constexpr double kTouch_px = 1.0;

// Bounding box of all lights over the whole motion.
struct Extent {
  Vector3d low = Vector3d::Constant(1e9);
  Vector3d high = Vector3d::Constant(-1e9);
};

Extent extent_of(const PointMotion& motion) {
  Extent extent;
  std::vector<Light> lights;
  for (double t_s = 0.0; t_s <= motion.length_s(); t_s += 0.1) {
    motion.at(t_s, lights);
    for (const Light& light : lights) {
      if (!light.there || !light.is_labelled) continue;
      extent.low = extent.low.cwiseMin(light.position);
      extent.high = extent.high.cwiseMax(light.position);
    }
  }
  return extent;
}

// A ring of equal cameras, far enough away to contain the whole motion in each image, with small random deviations from
// the ring.
Rig rig_around(const Extent& extent, int cameras, scene::Random& random) {
  const Vector3d middle = 0.5 * (extent.low + extent.high);
  const double half_m = 0.5 * (extent.high - extent.low).head<2>().norm();
  const double up_m = 0.5 * (extent.high.z() - extent.low.z());
  const double across_m = (half_m + 0.2) / std::sin(kHalfField_rad);
  const double upright_m = half_m + (up_m + 0.2) / std::tan(0.75 * kHalfField_rad);
  const double radius_m = std::max({4.0, across_m, upright_m});
  Rig rig;
  for (int c = 0; c < cameras; ++c) {
    const double step = 2.0 * std::numbers::pi / cameras;
    const double angle = step * (c + 0.4 * (random.uniform() - 0.5));
    const double away_m = radius_m * (1.0 + 0.1 * random.uniform());
    const Vector3d eye = middle + Vector3d(away_m * std::cos(angle), away_m * std::sin(angle), 0.5 + random.uniform());
    CameraModel camera;
    camera.name = "cam" + std::to_string(c + 1);
    camera.width_px = kWidth_px;
    camera.height_px = kHeight_px;
    const double focal_px = 0.5 * kWidth_px / std::tan(kHalfField_rad);
    camera.lens.fx_px = focal_px * (1.0 + 0.01 * random.uniform());
    camera.lens.fy_px = camera.lens.fx_px;
    camera.lens.cx_px = 0.5 * kWidth_px + 10.0 * (random.uniform() - 0.5);
    camera.lens.cy_px = 0.5 * kHeight_px + 10.0 * (random.uniform() - 0.5);
    camera.lens.distortion << -0.12, 0.04, 0.0005, -0.0005, -0.003;
    camera.camera_from_world = scene::look_at(eye, middle);
    rig.push_back(camera);
  }
  return rig;
}

}  // namespace

PointsWorld::PointsWorld(const WorldSettings& settings, const PointMotion& motion, std::uint64_t seed)
    : settings_(settings),
      motion_(motion),
      random_(seed),
      rig_(rig_around(extent_of(motion), settings.cameras, random_)),
      visibility_(settings.visibility, rig_.size(), motion.light_count(), random_.bits()) {
  now_.frames.resize(rig_.size());
  now_.lights_in.resize(rig_.size());
}

Vector2d PointsWorld::noise() {
  const double x = random_.normal();
  return settings_.noise_px * Vector2d(x, random_.normal());
}

const SeenInstant& PointsWorld::next() {
  const double t_s = static_cast<double>(number_) / settings_.rate_hz;
  if (number_ > 0) visibility_.advance(1.0 / settings_.rate_hz);
  now_.exposed_at = from_ns(1'000'000'000) + from_s(t_s);
  motion_.at(t_s, now_.lights);
  now_.alone_in.assign(now_.lights.size(), 0);
  now_.merged_in.assign(now_.lights.size(), 0);
  for (std::uint32_t c = 0; c < rig_.size(); ++c) {
    now_.frames[c].reset();
    now_.lights_in[c].clear();
    if (random_.uniform() < settings_.lost_frames) continue;
    BlobFrame& frame = now_.frames[c].emplace();
    frame.camera = CameraId{c};
    frame.number = number_;
    frame.exposed_at = now_.exposed_at + from_s(1e-6 * settings_.jitter_us * (2.0 * random_.uniform() - 1.0));
    frame.received_at = frame.detected_at = now_.exposed_at;
    see(c, frame);
    add_false_blobs(rig_[c], frame);
  }
  ++number_;
  return now_;
}

void PointsWorld::see(std::uint32_t camera, BlobFrame& frame) {
  spots_.clear();
  const CameraModel& model = rig_[camera];
  for (std::uint32_t i = 0; i < now_.lights.size(); ++i) {
    const Light& light = now_.lights[i];
    const bool missed = random_.uniform() < settings_.misses;
    if (!light.there || missed || !visibility_.sees(camera, i)) continue;
    const auto pixel = geometry::project(model, {light.position});
    if (!pixel || !geometry::in_image(model, *pixel)) continue;
    const double away_m = (model.camera_from_world * WorldPoint{light.position}).v.z();
    spots_.push_back({pixel->v, 0.5 * settings_.marker_diameter_m * model.lens.fx_px / away_m, i});
  }
  give_blobs(camera, frame);
}

namespace {

// Area, centroid and second moments of a union of discs, computed on a fine grid.
struct Silhouette {
  double area_px2 = 0.0;
  Vector2d centroid = Vector2d::Zero();
  double xx = 0.0, yy = 0.0, xy = 0.0;
};

template <class Discs>
Silhouette silhouette_of(const Discs& discs) {
  constexpr double kGrid_px = 0.2;
  Vector2d low = Vector2d::Constant(1e9), high = -low;
  for (const auto* disc : discs) {
    low = low.cwiseMin(disc->centre_px.array().matrix() - Vector2d::Constant(disc->radius_px));
    high = high.cwiseMax(disc->centre_px + Vector2d::Constant(disc->radius_px));
  }
  Silhouette sum;
  for (double y = low.y() + 0.5 * kGrid_px; y < high.y(); y += kGrid_px) {
    for (double x = low.x() + 0.5 * kGrid_px; x < high.x(); x += kGrid_px) {
      const Vector2d at(x, y);
      const bool lit = std::ranges::any_of(
          discs, [&](const auto* d) { return (at - d->centre_px).squaredNorm() <= d->radius_px * d->radius_px; });
      if (!lit) continue;
      const Vector2d off = at - low;
      sum.area_px2 += kGrid_px * kGrid_px;
      sum.centroid += kGrid_px * kGrid_px * off;
      sum.xx += kGrid_px * kGrid_px * off.x() * off.x();
      sum.yy += kGrid_px * kGrid_px * off.y() * off.y();
      sum.xy += kGrid_px * kGrid_px * off.x() * off.y();
    }
  }
  sum.centroid /= sum.area_px2;
  sum.xx = sum.xx / sum.area_px2 - sum.centroid.x() * sum.centroid.x();
  sum.yy = sum.yy / sum.area_px2 - sum.centroid.y() * sum.centroid.y();
  sum.xy = sum.xy / sum.area_px2 - sum.centroid.x() * sum.centroid.y();
  sum.centroid += low;
  return sum;
}

Blob blob_of(const Silhouette& shape) {
  Blob blob;
  blob.area_px2 = shape.area_px2;
  const double mean = 0.5 * (shape.xx + shape.yy);
  const double half_range = std::hypot(0.5 * (shape.xx - shape.yy), shape.xy);
  blob.roundness = std::sqrt(std::clamp((mean - half_range) / (mean + half_range), 0.0, 1.0));
  blob.axis_rad = 0.5 * std::atan2(2.0 * shape.xy, shape.xx - shape.yy);
  blob.centroid.v = shape.centroid;
  return blob;
}

}  // namespace

void PointsWorld::give_blobs(std::uint32_t camera, BlobFrame& frame) {
  group_of_.resize(spots_.size());
  for (std::uint32_t i = 0; i < spots_.size(); ++i) group_of_[i] = i;
  for (std::uint32_t i = 0; settings_.merge && i < spots_.size(); ++i) {
    for (std::uint32_t j = i + 1; j < spots_.size(); ++j) {
      const double touch_px = spots_[i].radius_px + spots_[j].radius_px + kTouch_px;
      if ((spots_[i].centre_px - spots_[j].centre_px).squaredNorm() >= touch_px * touch_px) continue;
      if (group_of_[i] == group_of_[j]) continue;
      std::ranges::replace(group_of_, std::uint32_t{group_of_[j]}, std::uint32_t{group_of_[i]});
    }
  }
  std::vector<const Spot*> discs;
  for (std::uint32_t group = 0; group < spots_.size(); ++group) {
    discs.clear();
    for (std::uint32_t i = 0; i < spots_.size(); ++i) {
      if (group_of_[i] == group) discs.push_back(&spots_[i]);
    }
    if (discs.empty()) continue;
    Blob blob;
    if (discs.size() == 1) {
      blob.centroid.v = discs[0]->centre_px;
      blob.area_px2 = std::numbers::pi * discs[0]->radius_px * discs[0]->radius_px;
    } else {
      blob = blob_of(silhouette_of(discs));
    }
    blob.centroid.v += noise();
    blob.sigma_px = settings_.noise_px;
    if (!frame.blobs.try_push_back(blob)) continue;
    auto& lights = now_.lights_in[camera].emplace_back();
    for (const Spot* disc : discs) lights.push_back(disc->light);
    auto& seen_in = discs.size() == 1 ? now_.alone_in : now_.merged_in;
    for (const Spot* disc : discs) seen_in[disc->light] |= std::uint64_t{1} << camera;
  }
}

void PointsWorld::add_false_blobs(const CameraModel& camera, BlobFrame& frame) {
  const double wanted = settings_.false_blobs * static_cast<double>(frame.blobs.size()) + random_.uniform();
  for (int i = 0; i + 1 <= static_cast<int>(wanted); ++i) {
    Blob blob;
    const double x = random_.uniform() * camera.width_px;
    blob.centroid.v = {x, random_.uniform() * camera.height_px};
    blob.sigma_px = settings_.noise_px;
    blob.area_px2 = 6.0;
    if (frame.blobs.try_push_back(blob)) now_.lights_in[frame.camera.value].emplace_back();
  }
}

}  // namespace mocap::simworld
