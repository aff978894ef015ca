#pragma once

#include <vector>

#include "model/skeleton.h"

namespace mocap::kinematics {

/// Of each bone: whether the markers, all of them seen, tell how it is turned. They do not where a bone carries no
/// markers away from the line through its joints (a neck between a chest and a head that each have their own), or one
/// marker only beyond its joint (a hand): it may be turned about that line as it likes.
///
/// Asked in the middle of all joints' ranges, where limbs are bent. Allocates.
std::vector<bool> rotation_observability(const MarkerSet& set);

}  // namespace mocap::kinematics
