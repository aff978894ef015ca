#include "lib/simworld/irregular_rig.h"

#include "scene/ring_rig.h"
#include "settings/rig/rig_file.h"

namespace mocap::simworld {

Eigen::Vector3d random_direction(scene::Random& random) {
  return Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
}

Result<Rig> irregular_rig(const SceneFile& scene, scene::Random& random) {
  if (!scene.rig_file.empty()) {
    auto loaded = settings::load_rig(scene.rig_file);
    if (!loaded) return Error{ErrorCode::InvalidArgument, settings::to_text(loaded.error())};
    return *std::move(loaded);
  }
  Rig rig = scene::ring_rig(scene.ring);
  for (CameraModel& camera : rig) {
    const Eigen::Vector3d eye = camera.centre().v + 0.2 * random.normal() * random_direction(random);
    camera.camera_from_world = scene::look_at(eye, Eigen::Vector3d(0.0, 0.0, 1.0) + 0.2 * random_direction(random));
  }
  return rig;
}

}  // namespace mocap::simworld
