#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "lib/simworld/scene_file.h"
#include "scene/actor.h"

namespace mocap::simworld {

/// An actor of a scene, and the subject of the daemon's settings that represents the actor.
struct Performer {
  static constexpr std::uint32_t kNobodys = 0xFFFF'FFFF;

  std::unique_ptr<scene::Actor> actor;
  Subject subject;
  std::vector<std::uint32_t>
      marker_of;  ///< by marker of the actor: the marker of the subject, or kNobodys if the subject lacks the marker
};

/// Creates the actors of a scene. Actors without a motion use `clip`. The same seed gives the same bodies. Fails with
/// NotFound if a motion file is missing, and with the error of a file that cannot be used.
Result<std::vector<Performer>> make_performers(const SceneFile& scene, const std::string& clip, std::uint64_t seed);

}  // namespace mocap::simworld
