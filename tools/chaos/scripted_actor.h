#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "chaos/fault.h"
#include "scene/actor.h"

namespace mocap::chaos {

/// The place of an actor before and after each SubjectsSwap.
struct ActorPlace {
  std::uint32_t subject = 0;
  Eigen::Vector2d own_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d other_m = Eigen::Vector2d::Zero();  ///< of the actor with whom the places are exchanged
};

/// Places an actor and makes it leave, lie down and change places with another actor, as the faults say.
std::unique_ptr<scene::Actor> make_scripted_actor(std::unique_ptr<scene::Actor> actor, const ActorPlace& place,
                                                  std::vector<Fault> faults);

}  // namespace mocap::chaos
