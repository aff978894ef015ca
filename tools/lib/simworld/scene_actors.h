#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "base/result.h"
#include "lib/simworld/scene_file.h"
#include "scene/actor.h"
#include "scene/random.h"

namespace mocap::simworld {

/// An actor of a scene, and the subject of the daemon's settings that represents the actor.
struct Performer {
  static constexpr std::uint32_t kNobodys = 0xFFFF'FFFF;

  std::unique_ptr<scene::Actor> actor;
  Subject subject;
  std::vector<std::uint32_t>
      marker_of;  ///< by marker of the actor: the marker of the subject, or kNobodys if the subject lacks the marker
};

/// The body of an actor: the marker set with scaled bones, and with normal errors of the marker offsets, each axis.
MarkerSet true_body(MarkerSet set, double size, double marker_error_mm, scene::Random random);

/// An actor with this body who moves as a BVH file says (`motion` ends in .bvh), with the T-pose of `wanted` before, or
/// as a program of acts says. Fails with NotFound, or with InvalidArgument and the reason.
Result<std::unique_ptr<scene::Actor>> make_body_actor(const std::string& motion, const MarkerSet& body,
                                                      const SceneActor& wanted);

/// Creates the actors of a scene. Actors without a motion use `clip`. The same seed gives the same bodies. Fails with
/// NotFound if a motion file is missing, and with the error of a file that cannot be used.
Result<std::vector<Performer>> make_performers(const SceneFile& scene, const std::string& clip, std::uint64_t seed);

}  // namespace mocap::simworld
