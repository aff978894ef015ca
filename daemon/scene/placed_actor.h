#pragma once

#include <Eigen/Core>
#include <memory>

#include "scene/actor.h"

namespace mocap::scene {

/// Where an actor performs, and when he begins.
struct Place {
  Eigen::Vector2d at_m = Eigen::Vector2d::Zero();  ///< of the actor's own middle
  double heading_rad = 0.0;                        ///< the whole motion turned about that, counter-clockwise from above
  double delay_s = 0.0;                            ///< later than he would; before that, as at his beginning
};

/// The same actor somewhere else.
std::unique_ptr<Actor> make_placed_actor(std::unique_ptr<Actor> actor, const Place& place);

}  // namespace mocap::scene
