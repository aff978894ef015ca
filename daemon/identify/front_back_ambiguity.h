#pragma once

#include "identify/tpose_finder.h"
#include "model/skeleton.h"

namespace mocap::identify {

/// Whether somebody in T-pose is read back to front who wears the set's arm and leg markers on the other face of their
/// limbs: in front of the elbow instead of behind it. Bones that sit in the body's middle wear theirs as the set says.
bool has_front_back_ambiguity(const MarkerSet& set, const FindSettings& settings);

}  // namespace mocap::identify
