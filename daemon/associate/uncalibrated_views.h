#pragma once

#include <memory>

#include "model/camera_model.h"
#include "module/matcher.h"

namespace mocap::associate {

/// The rig for the steps of the fusion: a camera that is not calibrated gets a model that sees nothing of the volume.
Rig with_blind_models(Rig rig);

/// Passes to `inner` no blobs of cameras that are not calibrated, so that their blobs stay unmatched. Returns `inner`
/// itself if all cameras of `rig` are calibrated. Never allocates after construction.
std::unique_ptr<Matcher> without_uncalibrated_views(std::unique_ptr<Matcher> inner, const Rig& rig);

}  // namespace mocap::associate
