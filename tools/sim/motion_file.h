#pragma once

#include <memory>

#include "base/result.h"
#include "options.h"
#include "scene/actor.h"

namespace mocap::sim {

/// Creates the actor with the motion of the options: built-in acts, a BVH or a C3D file. Fails with the error of the
/// motion or marker set file.
Result<std::unique_ptr<scene::Actor>> make_actor(const Options& options);

}  // namespace mocap::sim
