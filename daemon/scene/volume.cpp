#include "scene/volume.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "base/expects.h"
#include "geometry/lens.h"
#include "scene/random.h"

namespace mocap::scene {
namespace {

constexpr double kClutterRing_m = 3.0;  // largest distance of clutter from the centre of the volume

std::vector<WorldPoint> scatter(int count, std::uint64_t seed) {
  Random random(seed + 4711);
  std::vector<WorldPoint> points;
  for (int i = 0; i < count; ++i) {
    const double angle_rad = 2.0 * std::numbers::pi * random.uniform();
    const double radius_m = kClutterRing_m * (0.6 + 0.4 * random.uniform());
    points.push_back({{radius_m * std::cos(angle_rad), radius_m * std::sin(angle_rad), 2.5 * random.uniform()}});
  }
  return points;
}

}  // namespace

Volume::Volume(std::unique_ptr<Actor> actor, Rig rig, ImageSettings settings)
    : actor_(std::move(actor)), rig_(std::move(rig)), settings_(settings), flesh_(actor_->marker_set()) {
  MOCAP_EXPECTS(rig_.size() <= kMaxCameras);
  for (const CameraModel& camera : rig_) eyes_m_.push_back(camera.centre().v);
}

bool Volume::sees(std::size_t camera, const ActorState& state, std::size_t marker) const {
  if (settings_.nobody || !state.markers[marker].there) return false;
  const auto pixel = geometry::project(rig_[camera], state.markers[marker].position);
  if (!pixel || !geometry::in_image(rig_[camera], *pixel)) return false;
  return !settings_.occlusion || !flesh_.hides(state, marker, eyes_m_[camera]);
}

void Volume::truth(double t_s, Timestamp exposed_at, std::uint64_t number, Snapshot& into) const {
  ActorState state;
  actor_->at(t_s, state);
  into.number = number;
  into.description_version = 1;
  into.instants = {.exposed_at = exposed_at, .received_at = {}, .detected_at = {}, .fused_at = {}, .sent_at = {}};
  into.expected_views = static_cast<std::uint32_t>(rig_.size());
  into.views.clear();
  for (std::uint32_t i = 0; i < rig_.size(); ++i) into.views.push_back({CameraId{i}, number, Duration{}, 0});

  into.labels.resize(1);
  SubjectLabels& labels = into.labels[0];
  labels.subject = SubjectId{0};
  labels.phase = settings_.nobody ? SubjectPhase::Searching : SubjectPhase::Tracking;
  labels.markers.resize(state.markers.size());
  for (std::size_t i = 0; i < state.markers.size(); ++i) {
    LabelledMarker marker;
    marker.position = state.markers[i].position;
    marker.covariance_m2.setZero();
    for (std::size_t camera = 0; camera < rig_.size(); ++camera) {
      if (!sees(camera, state, i)) continue;
      ++marker.cameras;
      ++into.views[camera].blobs;
    }
    const bool there = !settings_.nobody && state.markers[i].there;
    marker.state = marker.cameras > 0 ? LabelState::Measured : there ? LabelState::Filled : LabelState::Lost;
    marker.confidence = there ? 1.0F : 0.0F;
    labels.markers[i] = marker;
  }

  into.poses.clear();
  if (!settings_.nobody && !state.world_from_bone.empty()) {
    into.poses.resize(1);
    into.poses[0].subject = SubjectId{0};
    into.poses[0].bones.resize(state.world_from_bone.size());
    for (std::size_t i = 0; i < state.world_from_bone.size(); ++i) {
      const int parent = actor_->marker_set().skeleton.bones[i].parent;
      const Pose& pose = state.world_from_bone[i];
      const Pose local = parent < 0 ? pose : state.world_from_bone[static_cast<std::size_t>(parent)].inverse() * pose;
      into.poses[0].bones[i] = {pose, local, BoneState::Measured, 1.0F};
    }
  }
  into.unlabelled.clear();
  for (const WorldPoint& ghost : state.ghosts) into.unlabelled.push_back({TrackId{}, ghost, 0.0, 0});
}

Eye::Eye(const Volume& volume, std::size_t camera, std::uint64_t noise)
    : volume_(volume),
      camera_(camera),
      renderer_(volume.rig()[camera].width_px, volume.rig()[camera].height_px, volume.settings(), noise),
      clutter_(scatter(volume.settings().clutter, volume.settings().seed)) {
  discs_.reserve(2 * (2 * kMaxLabels + clutter_.size()));
}

void Eye::see(double t_s, double exposure_s, std::uint64_t number, std::span<std::byte> pixels) {
  const Actor& actor = volume_.actor();
  actor.at(t_s - 0.5 * exposure_s, begin_);
  actor.at(t_s, middle_);
  actor.at(t_s + 0.5 * exposure_s, end_);

  discs_.clear();
  for (std::size_t i = 0; i < middle_.markers.size(); ++i) {
    if (!volume_.sees(camera_, middle_, i)) continue;
    const bool steady = begin_.markers[i].there && end_.markers[i].there;
    const WorldPoint& middle = middle_.markers[i].position;
    add(steady ? begin_.markers[i].position : middle, middle, steady ? end_.markers[i].position : middle);
  }
  if (!volume_.settings().nobody) {
    for (const WorldPoint& ghost : middle_.ghosts) add(ghost, ghost, ghost);
  }
  for (const WorldPoint& light : clutter_) add(light, light, light);
  renderer_.render(discs_, number, pixels);
}

// Adds the motion of a marker during the exposure as two straight lines that meet in the middle of the exposure.
void Eye::add(const WorldPoint& begin, const WorldPoint& middle, const WorldPoint& end) {
  const CameraModel& camera = volume_.rig()[camera_];
  const auto from = geometry::project(camera, begin), at = geometry::project(camera, middle),
             to = geometry::project(camera, end);
  if (!from || !at || !to) return;
  const ImageSettings& settings = volume_.settings();
  const double depth_m = (camera.camera_from_world * middle).v.z();
  const double radius_px = std::max(settings.least_radius_px, camera.lens.fx_px * settings.marker_radius_m / depth_m);
  if ((to->v - from->v).norm() < 0.05) {
    discs_.push_back({at->v, at->v, radius_px, 1.0});
  } else {
    discs_.push_back({from->v, at->v, radius_px, 0.5});
    discs_.push_back({at->v, to->v, radius_px, 0.5});
  }
}

}  // namespace mocap::scene
