#pragma once

#include "identify/t_pose_finder.h"
#include "model/skeleton.h"

namespace mocap::identify {

/// Whether somebody in T-pose is read back to front who wears the set's arm and leg markers on the other face of their
/// limbs: in front of the elbow instead of behind it. Bones that sit in the body's middle wear theirs as the set says.
bool is_read_back_to_front(const MarkerSet& set, const FindSettings& settings);

}  // namespace mocap::identify
