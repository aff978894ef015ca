#pragma once

#include <span>

#include "model/sighting.h"

namespace mocap {

/// Follows markers through the volume from set to set.
class MarkerTracker {
 public:
  virtual ~MarkerTracker() = default;

  /// Appends where each living track should be at `at`, with `track` set; changes nothing.
  virtual void predict(Timestamp at, Expected& into) const = 0;

  /// Moves all tracks on to `expected.at` with what was seen then: points, and rays of markers that one camera alone
  /// sees. The result is borrowed until the next call.
  virtual const TrackedMarkers& step(const Markers& markers, const Expected& expected,
                                     std::span<const BearingOnlyObservation> bearing_only = {}) = 0;
};

}  // namespace mocap
