#include "lib/simworld/scene_world.h"

#include <algorithm>
#include <utility>

#include "geometry/lens.h"

namespace mocap::simworld {
namespace {

constexpr double kLeastRadius_px = 1.5;  // glare of a retroreflector, as in scene::ImageSettings
constexpr std::uint32_t kSeenFrom = 2;   // number of cameras from which a marker counts as visible

}  // namespace

SceneWorld::SceneWorld(const SceneFile& scene, Rig rig, std::vector<Performer> performers, SceneEvents events,
                       std::uint64_t seed)
    : rate_hz_(scene.rate_hz),
      false_blobs_(scene.false_blobs),
      radius_m_(0.5e-3 * scene.marker_diameter_mm),
      occlusion_(scene.occlusion),
      rig_(std::move(rig)),
      performers_(std::move(performers)),
      events_(std::move(events)),
      states_(performers_.size()),
      random_(seed),
      maker_(scene.noise) {
  frames_.reserve(rig_.size());
  if (scene.drawn) drawn_ = std::make_unique<DrawnBlobs>(rig_, seed);
  for (const CameraModel& camera : rig_) eyes_m_.push_back(camera.centre().v);
  for (const Performer& performer : performers_) flesh_.emplace_back(performer.actor->marker_set());
}

void SceneWorld::step() {
  t_s_ = static_cast<double>(number_) / rate_hz_;
  const Timestamp at = from_ns(1'000'000'000) + from_s(t_s_);
  events_.advance(t_s_);
  move();
  frames_.clear();
  for (std::uint32_t camera = 0; camera < rig_.size(); ++camera) {
    if (!events_.delivers(camera)) continue;
    BlobFrame& frame = frames_.emplace_back();
    frame.camera = CameraId{camera};
    frame.number = number_;
    frame.exposed_at = frame.received_at = frame.detected_at = at;
    if (!events_.blind()) look(camera, frame.blobs);
  }
  truth_ = {};
  truth_.number = number_++;
  truth_.exposed_at = at;
  truth_.views = static_cast<std::uint32_t>(frames_.size());
  truth_.expected_views = static_cast<std::uint32_t>(rig_.size());
  update_truth();
}

void SceneWorld::move() {
  lights_.clear();
  for (std::uint32_t p = 0; p < performers_.size(); ++p) {
    scene::ActorState& state = states_[p];
    performers_[p].actor->at(t_s_, state);
    for (std::uint32_t m = 0; m < state.markers.size(); ++m) {
      if (state.markers[m].there) lights_.push_back({p, m, state.markers[m].position.v, 0});
    }
    for (const WorldPoint& ghost : state.ghosts) lights_.push_back({p, kGhost, ghost.v, 0});
  }
}

bool SceneWorld::is_hidden(const Light& light, std::uint32_t camera) const {
  if (light.marker != kGhost && events_.hides(light.performer, light.marker, camera)) return true;
  if (!occlusion_) return false;
  if (light.marker != kGhost && events_.shows(light.performer, light.marker, camera)) return false;
  for (std::uint32_t p = 0; p < performers_.size(); ++p) {
    const bool own = p == light.performer && light.marker != kGhost;
    const bool hidden = own ? flesh_[p].hides(states_[p], light.marker, eyes_m_[camera])
                            : flesh_[p].hides(states_[p], light.at_m, eyes_m_[camera]);
    if (hidden) return true;
  }
  return false;
}

int SceneWorld::false_count(std::size_t lit) {
  return static_cast<int>(false_blobs_ * static_cast<double>(lit) + random_.uniform());
}

void SceneWorld::add_false_spots(const CameraModel& model) {
  const int extra = false_count(spots_.size());
  for (int i = 0; i < extra; ++i) {
    const double x_px = random_.uniform() * model.width_px;
    spots_.push_back({{x_px, random_.uniform() * model.height_px}, kLeastRadius_px, 0});
  }
}

void SceneWorld::look(std::uint32_t camera, Blobs& blobs) {
  const CameraModel& model = rig_[camera];
  spots_.clear();
  for (std::uint32_t i = 0; i < lights_.size(); ++i) {
    const WorldPoint at{lights_[i].at_m};
    const auto pixel = geometry::project(model, at);
    if (!pixel || !geometry::in_image(model, *pixel) || is_hidden(lights_[i], camera)) continue;
    const double depth_m = (model.camera_from_world * at).v.z();
    spots_.push_back({pixel->v, std::max(kLeastRadius_px, model.lens.fx_px * radius_m_ / depth_m), i});
  }
  const std::size_t lit = spots_.size();
  if (drawn_) add_false_spots(model);
  const auto shown = drawn_ ? drawn_->see(camera, number_, spots_, blobs) : maker_.see(spots_, random_, blobs);
  for (std::size_t i = 0; i < lit; ++i) {
    if (shown[i] != BlobMaker::kNone) ++lights_[spots_[i].light].cameras;
  }
  if (drawn_) return;
  const int extra = false_count(lit);
  for (int i = 0; i < extra; ++i) maker_.add_false(model.width_px, model.height_px, random_, blobs);
  // A detector lists blobs from the top of the image to the bottom.
  std::ranges::sort(blobs, {}, [](const Blob& blob) { return blob.centroid.v.y(); });
}

void SceneWorld::update_truth() {
  for (const Light& light : lights_) {
    const bool nobodys =
        light.marker == kGhost || performers_[light.performer].marker_of[light.marker] == Performer::kNobodys;
    if (nobodys) truth_.unlabelled_m.push_back(light.at_m);
    if (nobodys) continue;
    const std::uint32_t marker = performers_[light.performer].marker_of[light.marker];
    truth_.markers.push_back({light.performer, marker, light.cameras > 0 ? LabelState::Measured : LabelState::Filled,
                              light.at_m, light.cameras});
  }
  const auto name = [](const scoring::NamedMarker& marker) { return std::pair(marker.subject, marker.marker); };
  std::ranges::sort(truth_.markers, {}, name);
  for (std::uint32_t p = 0; p < performers_.size(); ++p) {
    const auto& bones = states_[p].world_from_bone;
    for (std::uint32_t b = 0; b < bones.size(); ++b) {
      truth_.bones.push_back({p, b, BoneState::Filled, bones[b].position, bones[b].rotation});
    }
  }
  for (const Light& light : lights_) {
    if (light.marker == kGhost || light.cameras < kSeenFrom) continue;
    const auto bone =
        static_cast<std::uint32_t>(performers_[light.performer].actor->marker_set().markers[light.marker].bone);
    for (scoring::PosedBone& posed : truth_.bones) {
      if (posed.subject == light.performer && posed.bone == bone) posed.state = BoneState::Measured;
    }
  }
}

}  // namespace mocap::simworld
