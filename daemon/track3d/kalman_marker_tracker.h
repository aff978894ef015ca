#pragma once

#include <cstdint>
#include <memory>

#include "base/time.h"
#include "module/marker_tracker.h"

namespace mocap::track3d {

struct TrackMarkersSettings {
  double gate_sigmas = 4.0;        ///< 1 to 10; a marker further from where it should be is another one
  double gate_floor_m = 0.004;     ///< standard deviation that the gate has at least, 0 to 0.1
  double gate_per_speed = 0.1;     ///< the same, for each m that the marker is expected to move, 0 to 2
  std::uint32_t confirm_sets = 3;  ///< consecutive sets until a track is believed, 1 to 100
  Duration max_coast = std::chrono::milliseconds(500);  ///< unseen for longer, a track ends
  double max_coast_sigma_m = 0.15;                      ///< an unseen track that is known no better ends, 0.001 to 10
  double acceleration_m_s2 = 5.0;                       ///< standard deviation of what changes the motion, 0.01 to 1000
  double acceleration_per_speed_1_s = 6.0;              ///< the same, for each m/s of speed, 0 to 100
  double max_agility = 25.0;     ///< how many times its square may grow while sightings surprise, 1 to 1000
  double birth_speed_m_s = 2.0;  ///< standard deviation of a new marker's velocity, 0.01 to 100
  Duration coast_half_life = std::chrono::milliseconds(200);  ///< an unseen marker's speed halves; 0: it goes on
  double sighting_floor_m = 0.00002;  ///< no sighting is more certain, 0 to 0.1: the marker's own shape
};

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
