#pragma once

#include <span>

#include "base/archive.h"
#include "base/time.h"
#include "model/handover.h"
#include "model/predictions.h"
#include "model/sighting.h"

namespace mocap {

/// Tracks markers in 3D from set to set.
///
/// One thread makes all calls.
class MarkerTracker {
 public:
  virtual ~MarkerTracker() = default;

  /// Predicts the position of each 3D track at `at`, in the order of the track ids, without labels. Candidates
  /// are not predicted. Does not change the tracks. The result is borrowed until the next call.
  virtual const PredictedMarkers& predict(Timestamp at) = 0;

  /// Advances all tracks to `predicted.at` and updates them with the markers and the bearing-only observations of the
  /// set, both of which refer to `predicted`. Candidates have tracks of their own, which are reported after the others.
  /// The result is borrowed until the next call.
  virtual const TrackedMarkers& step(const Markers& markers, const Predictions& predicted,
                                     std::span<const BearingOnlyObservation> bearing_only = {},
                                     std::span<const CandidatePoint> candidates = {}) = 0;

  /// Takes over the 3D tracks of the tracker of the configuration before, if poses continue. In any case an id that
  /// `before` gave to a track is not used again. Call before the first `step`. A tracker without memory, or of another
  /// kind than `before`, does nothing.
  virtual void adopt(MarkerTracker& /*before*/, const Handover& /*handover*/) {}

  /// Writes the belief, or takes it over from a tracker that was built with the same settings. Call between two sets. A
  /// tracker without memory does nothing.
  virtual void archive(Archive& /*members*/) {}
};

}  // namespace mocap
