#pragma once

#include "calibration/wand_views.h"

namespace mocap::calibration {

/// Relates the cameras in pairs and gives each a place in the frame of the first, over the overlaps that tell most.
/// `reach_px`: how far a spot may lie from its epipolar line.
Result<Rig, WandRefusal> join_cameras(const WandViews& views, const Rig& start, const Wand& wand,
                                      const WandSettings& settings, double reach_px, const Progress& progress);

}  // namespace mocap::calibration
