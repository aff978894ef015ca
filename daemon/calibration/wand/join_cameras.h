#pragma once

#include <optional>

#include "calibration/wand/wand_views.h"

namespace mocap::calibration {

/// Relates the cameras in pairs and gives each a place in the frame of the first, over the overlaps that tell most.
/// `reach_px`: how far a spot may lie from its epipolar line.
Result<Rig, WandRefusal> join_cameras(const WandViews& views, const Rig& start, const Wand& wand,
                                      const WandSettings& settings, double reach_px, const Progress& progress);

/// Refuses a camera that goes with another only if its images are turned round as in a mirror.
std::optional<WandRefusal> refuse_mirrored(const WandViews& views, const Rig& start, std::size_t camera,
                                           const Wand& wand, const WandSettings& settings, double reach_px);

}  // namespace mocap::calibration
