#pragma once

#include <memory>

#include "module/marker_tracker.h"
#include "track3d/track_markers_settings.h"

namespace mocap::track3d {

/// Makes a multi-target tracker of 3D markers: a Kalman filter with a nearly constant velocity model and adaptive
/// process noise for each track, and global nearest neighbour association (Bar-Shalom, Li and Kirubarajan 2001;
/// Bar-Shalom and Fortmann 1988).
///
/// Association: a marker that the matcher found at the prediction of a track updates that track, within a wider gate
/// than `gate_sigmas`, because the matcher has compared it with all other markers. The remaining markers are assigned
/// to the remaining tracks with the least total cost inside the gates, confirmed tracks first. A track that was
/// observed in the last set may be assigned an outlier beyond its gate.
///
/// Track life: an unassigned marker initiates a tentative track, or a confirmed one if a skeleton predicted it (a
/// prediction with a label and without a track). A tentative track ends when it is not observed. A confirmed track
/// coasts for `max_coast` and while its standard deviation is below `max_coast_sigma_m`; an older prediction would be
/// assigned whatever appears near it. A bearing-only observation updates a track across the ray; the track is still
/// coasting.
///
/// MarkerTracker::predict returns the covariance of the gate, in which the matcher searches. The settings must be in
/// their ranges. Neither `step` nor `predict` allocates.
std::unique_ptr<MarkerTracker> make_marker_tracker(const TrackMarkersSettings& settings);

}  // namespace mocap::track3d
