#pragma once

#include <memory>

#include "scene/actor.h"
#include "scene/program.h"

namespace mocap::scene {

/// A person with `marker_set` who performs `program`. Bones without a name of human38 keep their rest pose. The feet
/// are on the floor; the root of a body without feet is 1 m above the floor.
std::unique_ptr<Actor> make_procedural_actor(MarkerSet marker_set, Program program);

}  // namespace mocap::scene
