#pragma once

#include "identify/tpose_finder.h"
#include "model/skeleton.h"

namespace mocap::identify {

/// Whether TPoseFinder identifies a body back to front whose limb markers are on the other face of the limb than in the
/// set (in front of the elbow instead of behind it). Markers of central bones are at the positions of the set.
bool has_front_back_ambiguity(const MarkerSet& set, const FindSettings& settings);

}  // namespace mocap::identify
