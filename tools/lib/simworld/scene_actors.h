#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "lib/simworld/scene_file.h"
#include "scene/actor.h"

namespace mocap::simworld {

/// An actor of a scene, and the subject as which the daemon knows him.
struct Performer {
  static constexpr std::uint32_t kNobodys = 0xFFFF'FFFF;

  std::unique_ptr<scene::Actor> actor;
  Subject subject;
  std::vector<std::uint32_t> marker_of;  ///< the subject's marker that each of the actor's is; kNobodys: none
};

/// Makes a scene's actors with the motion of `clip` where they have none of their own. The same seed gives the same
/// bodies. Fails with NotFound where a motion is missing, else with what is wrong with a file.
Result<std::vector<Performer>> make_performers(const SceneFile& scene, const std::string& clip, std::uint64_t seed);

}  // namespace mocap::simworld
