#pragma once

#include <memory>

#include "associate/match_settings.h"
#include "model/camera_model.h"
#include "module/matcher.h"

namespace mocap::associate {

/// A Matcher: the expected markers first, the rest by epipolar geometry.
///
/// Known: each expected place is projected with its covariance into each view; in each view all expected markers are
/// assigned to blobs at once, exactly; the views of a marker must then agree on one point, or the odd one is left out.
/// Two views are enough. One view alone is left free, counted in Matches::seen_once, and told in Matches::lone where
/// no new marker needs its blob.
///
/// New: two blobs near each other's epipolar lines and rays that meet inside the volume make a hypothesis; the other
/// views support it or not; the best (most views, then least error) take their blobs first. Of two-view hypotheses
/// that share a blob none is believed. The work for one set is bounded; what was left untried is counted in
/// Matches::skipped. Of more than 16 cameras not all pairs are asked in every set, but all within a few.
///
/// Blobs are told by Blob::centroid and sigma_px. Cameras of the sets index `rig`. Never allocates after construction.
std::unique_ptr<Matcher> make_matcher(const MatchSettings& settings, Rig rig);

}  // namespace mocap::associate
