#include "lib/simworld/drift_world.h"

#include <Eigen/Geometry>
#include <numbers>
#include <utility>

#include "lib/simworld/irregular_rig.h"
#include "scene/random.h"

namespace mocap::simworld {
namespace {

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
  auto made = irregular_rig(scene, random);
  if (!made) return made.error();
  const Rig rig = *std::move(made);
  DriftWorld world;
  world.at_s_ = bump.at_s;
  world.camera_ = static_cast<std::uint32_t>(random.bits() % rig.size());
  Rig truth = rig;
  CameraModel& camera = truth[world.camera_];
  const Eigen::Vector3d centre = camera.centre().v + 1e-3 * bump.move_mm * random_direction(random);
  const Eigen::AngleAxisd turn(bump.turn_deg * std::numbers::pi / 180.0, random_direction(random));
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
