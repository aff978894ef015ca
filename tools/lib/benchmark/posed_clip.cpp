#include "lib/benchmark/posed_clip.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "lib/simworld/scene_actors.h"
#include "scene/occlusion.h"
#include "scene/random.h"
#include "scene/ring_rig.h"
#include "settings/subject/marker_set_file.h"

namespace mocap::benchmark {
namespace {

using Eigen::Vector3d;

constexpr double kClipTransition_s = 1.0;
constexpr double kSkinMemory_s = 0.2;

// A stationary Gaussian process in three axes with an exponential covariance (Ornstein and Uhlenbeck).
class Drifting {
 public:
  Drifting(double sigma, double dt_s, scene::Random random)
      : keep_(std::exp(-dt_s / kSkinMemory_s)), add_(sigma * std::sqrt(1.0 - keep_ * keep_)), random_(random) {
    value_ = sigma * normal();
  }
  const Vector3d& value() const { return value_; }
  void step() { value_ = keep_ * value_ + add_ * normal(); }

 private:
  Vector3d normal() {
    const double x = random_.normal(), y = random_.normal();
    return {x, y, random_.normal()};
  }

  double keep_, add_;
  scene::Random random_;
  Vector3d value_ = Vector3d::Zero();
};

// The displacement of each marker on its bone.
class SoftTissue {
 public:
  SoftTissue(const MarkerSet& body, const PosedClipSettings& settings) {
    const double sigma_m = soft_tissue_sigma_m(settings.soft_tissue_mm);
    const auto process = [&](std::uint64_t stream) {
      return Drifting(sigma_m, 1.0 / settings.rate_hz, scene::Random(scene::mixed(settings.seed + 1) + stream));
    };
    for (std::size_t b = 0; b < body.skeleton.bones.size(); ++b) of_bone_.push_back(process(b));
    for (const MarkerOnBone& marker : body.markers) {
      bones_.push_back(static_cast<std::size_t>(marker.bone));
      of_marker_.push_back(process(1000 + of_marker_.size()));
    }
  }

  Vector3d offset_m(std::size_t marker) const { return of_bone_[bones_[marker]].value() + of_marker_[marker].value(); }
  void step() {
    for (Drifting& each : of_bone_) each.step();
    for (Drifting& each : of_marker_) each.step();
  }

 private:
  std::vector<std::size_t> bones_;
  std::vector<Drifting> of_bone_, of_marker_;
};

// The cameras that a body may hide its markers from; without cameras, everything is visible.
class Watchers {
 public:
  Watchers(const MarkerSet& body, int cameras) : flesh_(body) {
    if (cameras == 0) return;
    for (const CameraModel& camera : scene::ring_rig({.cameras = cameras})) eyes_m_.push_back(camera.centre().v);
  }

  bool see(const scene::ActorState& state, std::size_t marker) const {
    if (eyes_m_.empty()) return true;
    const auto sees = [&](const Vector3d& eye_m) { return !flesh_.hides(state, marker, eye_m); };
    return std::ranges::count_if(eyes_m_, sees) >= 2;
  }

 private:
  scene::Flesh flesh_;
  std::vector<Vector3d> eyes_m_;
};

Result<std::unique_ptr<scene::Actor>> actor_of(const std::string& motion, const MarkerSet& body) {
  simworld::SceneActor wanted;
  wanted.t_pose_s = kClipTPose_s;
  // A program has no pose of its own before it.
  if (!motion.ends_with(".bvh")) return simworld::make_body_actor("tpose:3," + motion, body, wanted);
  return simworld::make_body_actor(motion, body, wanted);
}

}  // namespace

// An rms distance has three axes; bone and marker have half of the variance each.
double soft_tissue_sigma_m(double rms_mm) { return 1e-3 * rms_mm / std::sqrt(6.0); }

Result<PosedClip> make_posed_clip(const std::string& motion, const std::filesystem::path& marker_set_file,
                                  const PosedClipSettings& settings) {
  Result<MarkerSet> given = settings::load_marker_set(marker_set_file);
  if (!given) return given.error();
  PosedClip made;
  made.soft_tissue_mm = settings.soft_tissue_mm;
  made.body = simworld::true_body(*given, settings.size, settings.marker_error_mm, scene::Random(settings.seed));
  auto actor = actor_of(motion, made.body);
  if (!actor) return actor.error();
  LabelledClip& clip = made.clip;
  clip.name = std::filesystem::path(motion).stem().string();
  clip.rate_hz = settings.rate_hz;
  clip.take.markers = given->markers.size();
  clip.marker_set = *std::move(given);
  made.begin = static_cast<std::size_t>(std::ceil((kClipTPose_s + kClipTransition_s) * settings.rate_hz));

  const std::size_t frames = made.begin + static_cast<std::size_t>(settings.seconds * settings.rate_hz);
  SoftTissue tissue(made.body, settings);
  const Watchers watchers(made.body, settings.occlusion_cameras);
  scene::ActorState state;
  for (std::size_t frame = 0; frame < frames; ++frame, tissue.step()) {
    (*actor)->at(static_cast<double>(frame) / settings.rate_hz, state);
    made.poses.insert(made.poses.end(), state.world_from_bone.begin(), state.world_from_bone.end());
    for (std::size_t m = 0; m < clip.take.markers; ++m) {
      const Pose& bone = state.world_from_bone[static_cast<std::size_t>(made.body.markers[m].bone)];
      const bool seen = state.markers[m].there && watchers.see(state, m);
      clip.take.places_m.push_back(seen ? Vector3d(state.markers[m].position.v + bone.rotation * tissue.offset_m(m))
                                        : Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()));
    }
  }
  return made;
}

}  // namespace mocap::benchmark
