#pragma once

#include <memory>

#include "associate/match_settings.h"
#include "model/camera_model.h"
#include "module/matcher.h"

namespace mocap::associate {

/// Makes a Matcher that associates the predicted markers first (PredictedMatcher), then finds new markers by epipolar
/// geometry (UnassignedMatcher).
///
/// A predicted marker needs two views. A marker with one view is counted in Matches::seen_once and reported in
/// Matches::bearing_only if no new marker needs its blob. The work for one set is bounded; hypotheses that were not
/// tried are counted in Matches::skipped. With more than 16 cameras, each set covers a part of the camera pairs, and a
/// few sets cover all.
///
/// `rig` has 1 to kMaxCameras cameras; CameraId indexes it. Never allocates after construction.
std::unique_ptr<Matcher> make_matcher(const MatchSettings& settings, Rig rig);

}  // namespace mocap::associate
