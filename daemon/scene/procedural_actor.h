#pragma once

#include <memory>

#include "scene/actor.h"
#include "scene/program.h"

namespace mocap::scene {

/// Somebody who wears `marker_set` and performs `program`. Bones that are not named as in human18 keep their rest
/// pose; feet stand on the floor, and a body without feet floats at 1 m.
std::unique_ptr<Actor> make_procedural_actor(MarkerSet marker_set, Program program);

}  // namespace mocap::scene
