#pragma once

#include <memory>

#include "module/marker_tracker.h"
#include "track3d/track_markers_settings.h"

namespace mocap::track3d {

/// Makes the tracker of markers in the volume: constant velocity with noise that follows the motion, and each marker's
/// own covariance.
///
/// A marker whose expectation names a living track updates that track, unless it lies far outside of its gate (half as
/// wide again: the matcher has weighed it against all others); all others are given to the tracks that are left, best
/// in sum within the gates, believed tracks first; a track that was seen in the last set may be thrown off its way,
/// farther than its gate. What is left over is born as a tentative track, or as a confirmed one where the body had told
/// its place (an expectation with a label and no track). A tentative track dies when it is not seen, a confirmed one
/// coasts: for a time, and while it knows its place better than markers lie apart. An older guess would take whatever
/// appears, and its id would tell a lie. A ray of the one camera that sees a hidden marker keeps its track in place
/// across the ray; it coasts still, and is no better known along the ray than its motion tells.
///
/// `predict` gives the covariance of the gate: where the matcher should look. Settings are in their ranges. `step` and
/// `predict` do not allocate; one thread at a time.
std::unique_ptr<MarkerTracker> make_marker_tracker(const TrackMarkersSettings& settings);

}  // namespace mocap::track3d
