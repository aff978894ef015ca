#pragma once

#include <Eigen/Core>

#include "base/result.h"
#include "lib/simworld/scene_file.h"
#include "model/camera_model.h"
#include "scene/random.h"

namespace mocap::simworld {

/// A uniformly distributed unit vector.
Eigen::Vector3d random_direction(scene::Random& random);

/// The rig of a scene: that of its file, or its ring with random deviations of position (20 cm) and viewing direction,
/// as in a real room. Fails if the file cannot be used.
Result<Rig> irregular_rig(const SceneFile& scene, scene::Random& random);

}  // namespace mocap::simworld
