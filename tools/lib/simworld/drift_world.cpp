#include "lib/simworld/drift_world.h"

#include <Eigen/Geometry>
#include <numbers>
#include <utility>

#include "scene/random.h"
#include "scene/ring_rig.h"
#include "settings/rig_file.h"

namespace mocap::simworld {
namespace {

Eigen::Vector3d direction(scene::Random& random) {
  return Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
}

// Cameras that nobody has set up with a ruler.
Rig rig_of(const SceneFile& scene, scene::Random& random) {
  Rig rig = scene::ring_rig(scene.ring);
  for (CameraModel& camera : rig) {
    const Eigen::Vector3d eye = camera.centre().v + 0.2 * random.normal() * direction(random);
    camera.camera_from_world = scene::look_at(eye, Eigen::Vector3d(0.0, 0.0, 1.0) + 0.2 * direction(random));
  }
  return rig;
}

Result<std::unique_ptr<SceneWorld>> world_of(const SceneFile& scene, const Rig& rig, std::uint64_t seed) {
  auto performers = make_performers(scene, {}, seed);
  if (!performers) return performers.error();
  auto events = SceneEvents::make(scene, *performers, rig.size(), seed, true);
  if (!events) return events.error();
  return std::make_unique<SceneWorld>(scene, rig, std::move(*performers), std::move(*events), seed);
}

}  // namespace

Result<DriftWorld> DriftWorld::make(const SceneFile& scene, const Bump& bump, std::uint64_t seed) {
  scene::Random random(scene::mixed(seed ^ 0xD21F7));
  Rig rig;
  if (scene.rig_file.empty()) {
    rig = rig_of(scene, random);
  } else {
    auto loaded = settings::load_rig(scene.rig_file);
    if (!loaded) return Error{ErrorCode::InvalidArgument, settings::to_text(loaded.error())};
    rig = *std::move(loaded);
  }
  DriftWorld world;
  world.at_s_ = bump.at_s;
  world.camera_ = static_cast<std::uint32_t>(random.bits() % rig.size());
  Rig truth = rig;
  CameraModel& camera = truth[world.camera_];
  const Eigen::Vector3d centre = camera.centre().v + 1e-3 * bump.move_mm * direction(random);
  const Eigen::AngleAxisd turn(bump.turn_deg * std::numbers::pi / 180.0, direction(random));
  camera.camera_from_world.rotation = turn * camera.camera_from_world.rotation;
  camera.camera_from_world.translation = -(camera.camera_from_world.rotation * centre);
  auto before = world_of(scene, rig, seed);
  if (!before) return before.error();
  auto after = world_of(scene, truth, seed);
  if (!after) return after.error();
  world.before_ = std::move(*before);
  world.after_ = std::move(*after);
  return world;
}

void DriftWorld::step() {
  before_->step();
  after_->step();
}

std::vector<Subject> DriftWorld::subjects() const {
  std::vector<Subject> subjects;
  for (const Performer& performer : before_->performers()) subjects.push_back(performer.subject);
  return subjects;
}

}  // namespace mocap::simworld
