#pragma once

#include <Eigen/Core>
#include <memory>

#include "scene/actor.h"

namespace mocap::scene {

/// Position, heading and start of an actor's motion.
struct Place {
  Eigen::Vector2d at_m = Eigen::Vector2d::Zero();  ///< position of the actor's origin
  double heading_rad = 0.0;                        ///< rotation of the motion about that, counter-clockwise from above
  double delay_s = 0.0;                            ///< start of the motion; before that, the state at 0
};

/// An actor with the motion of `actor` at another place.
std::unique_ptr<Actor> make_placed_actor(std::unique_ptr<Actor> actor, const Place& place);

}  // namespace mocap::scene
