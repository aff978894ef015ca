#pragma once

#include <vector>

#include "model/skeleton.h"

namespace mocap::kinematics {

/// Whether a marker set, with all its markers detected, determines the rotation of each bone. It does not where all
/// markers of a bone lie on the line through its joints (a neck between a chest and a head with markers of their own),
/// and where a bone has one marker only beyond its joint (a hand): the rotation about that line (twist) is then
/// unobservable.
///
/// Computed in the middle of all joint ranges, where limbs are bent, from the posterior covariance of the pose. By
/// bone. Allocates.
std::vector<bool> rotation_observability(const MarkerSet& set);

}  // namespace mocap::kinematics
