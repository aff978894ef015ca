#pragma once

#include <cstdint>

#include "base/bounded_vector.h"
#include "base/time.h"
#include "model/bounds.h"
#include "model/ids.h"
#include "model/points.h"

namespace mocap {

/// A marker in 3D with its track.
struct CalibrationMarker {
  TrackId track;
  WorldPoint at;
  std::uint32_t cameras = 0;  ///< number of cameras that see it
};

/// All measured markers of one instant, with and without a label.
struct CalibrationMarkers {
  Timestamp exposed_at;
  BoundedVector<CalibrationMarker, kMaxMarkers> markers;
};

struct Snapshot;

/// The measured markers of a snapshot that have a track.
CalibrationMarkers measured_markers(const Snapshot& snapshot);

}  // namespace mocap
