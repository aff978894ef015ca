#include "lib/simworld/fuse_world.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "geometry/lens.h"
#include "scene/procedural_actor.h"
#include "scene/program.h"
#include "scene/ring_rig.h"

namespace mocap::simworld {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kRadius_px = 3.0;  // radius of a marker's disc
// Offset of each person from the middle of the volume, m. People walk through each other because only markers are
// simulated.
constexpr std::array<std::pair<double, double>, 8> kPlaces_m{
    {{0.0, 0.0}, {0.7, 0.5}, {-0.7, -0.4}, {0.5, -0.8}, {-0.5, 0.8}, {1.0, -0.2}, {-1.0, 0.2}, {0.1, 0.9}}};
constexpr std::array<const char*, 4> kPrograms{"walk", "walk:6,wave:4,walk", "walk:3,crouch:3,walk", "spin:4,walk"};

Rig bent_ring(int cameras) {
  Rig rig = scene::ring_rig({.cameras = cameras, .width_px = 1280, .height_px = 1024, .hfov_rad = 1.3});
  for (CameraModel& camera : rig) camera.lens.distortion << -0.18, 0.06, 0.0008, -0.0005, -0.004;
  return rig;
}

scene::Program program_of(std::size_t person) { return *scene::parse_program(kPrograms[person % kPrograms.size()]); }

}  // namespace

FuseWorld::FuseWorld(const FuseWorldSettings& settings, const MarkerSet& marker_set)
    : settings_(settings), rig_(bent_ring(settings.cameras)), random_(settings.seed) {
  const auto wanted = static_cast<std::size_t>(settings.markers);
  const std::size_t people = (wanted + marker_set.markers.size() - 1) / marker_set.markers.size();
  for (std::size_t i = 0; i < people; ++i) people_.push_back(scene::make_procedural_actor(marker_set, program_of(i)));
  for (std::uint32_t camera = 0; camera < rig_.size(); ++camera) {
    frames_.push_back(std::make_unique<BlobFrame>());
    frames_.back()->camera = CameraId{camera};
  }
}

void FuseWorld::step(std::uint64_t number) {
  const double t_s = static_cast<double>(number) / settings_.rate_hz;
  move(t_s);
  views_.assign(markers_.size(), 0);
  for (std::size_t camera = 0; camera < rig_.size(); ++camera) {
    BlobFrame& frame = *frames_[camera];
    frame.number = number;
    frame.exposed_at = frame.received_at = frame.detected_at = from_ns(0) + from_s(1.0 + t_s);
    look(camera);
  }
}

void FuseWorld::move(double t_s) {
  markers_.clear();
  for (std::size_t i = 0; i < people_.size(); ++i) {
    // Each person starts at a different time of the motion, which depends on the seed.
    const double begun_s = 1.7 * static_cast<double>(i) + static_cast<double>(settings_.seed % 97) * 0.31;
    people_[i]->at(begun_s + t_s, state_);
    const auto [x_m, y_m] = kPlaces_m[i % kPlaces_m.size()];
    for (const scene::ActorMarker& marker : state_.markers) {
      if (markers_.size() == static_cast<std::size_t>(settings_.markers)) return;
      markers_.push_back({marker.position.v + Vector3d(x_m, y_m, 0.0)});
    }
  }
}

void FuseWorld::look(std::size_t camera) {
  const CameraModel& model = rig_[camera];
  lights_.clear();
  const auto add = [&](const Vector2d& at, int marker) {
    Blob blob;
    blob.centroid.v = at;
    blob.sigma_px = settings_.sigma_px;
    blob.area_px2 = std::numbers::pi * kRadius_px * kRadius_px;
    blob.peak = 1.0;
    lights_.push_back({blob, marker});
  };
  for (std::size_t m = 0; m < markers_.size(); ++m) {
    const auto pixel = geometry::project(model, markers_[m]);
    if (!pixel || !geometry::in_image(model, *pixel) || random_.uniform() < settings_.missed) continue;
    add(pixel->v, static_cast<int>(m));
  }
  const double extra = settings_.false_blobs * settings_.markers + random_.uniform();
  for (int i = 0; i < static_cast<int>(extra); ++i) {
    add({random_.uniform() * model.width_px, random_.uniform() * model.height_px}, -1);
  }
  merge(lights_);
  // A detector lists blobs from the top of the image to the bottom.
  std::ranges::sort(lights_, {}, [](const Light& light) { return light.blob.centroid.v.y(); });

  Blobs& blobs = frames_[camera]->blobs;
  blobs.clear();
  for (Light& light : lights_) {
    light.blob.centroid.v += settings_.sigma_px * Vector2d(random_.normal(), random_.normal());
    if (!blobs.try_push_back(light.blob)) break;
    if (light.marker >= 0) ++views_[static_cast<std::size_t>(light.marker)];
  }
}

// Joins discs that touch into one blob. The roundness of the blob depends on the distance of the discs.
void FuseWorld::merge(std::vector<Light>& lights) {
  for (std::size_t i = 0; i < lights.size(); ++i) {
    for (std::size_t j = i + 1; j < lights.size(); ++j) {
      const Vector2d apart = lights[j].blob.centroid.v - lights[i].blob.centroid.v;
      const double half_px = 0.5 * apart.norm();
      if (half_px >= kRadius_px || lights[i].blob.merged || lights[j].blob.merged) continue;
      const double along_px2 = 0.25 * kRadius_px * kRadius_px + half_px * half_px;
      Blob& both = lights[i].blob;
      both.centroid.v += 0.5 * apart;
      both.area_px2 *= 1.0 + half_px / kRadius_px;
      both.roundness = 0.5 * kRadius_px / std::sqrt(along_px2);
      both.axis_rad = std::atan2(apart.y(), apart.x());
      both.merged = true;
      lights[i].marker = -1;
      lights.erase(lights.begin() + static_cast<std::ptrdiff_t>(j));
      --j;
    }
  }
}

}  // namespace mocap::simworld
