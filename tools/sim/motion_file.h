#pragma once

#include <memory>

#include "base/result.h"
#include "options.h"
#include "scene/actor.h"

namespace mocap::sim {

/// Who moves, and how: built-in acts, a BVH or a C3D file. Fails with what is wrong with the motion or marker set.
Result<std::unique_ptr<scene::Actor>> make_actor(const Options& options);

}  // namespace mocap::sim
