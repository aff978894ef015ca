#pragma once

#include <cstdint>
#include <optional>

#include "base/bounded_vector.h"
#include "base/time.h"
#include "model/sighting.h"
#include "model/subject_state.h"

namespace mocap {

/// The five instants of a snapshot, on the host's monotonic clock, each taken by the thread that did it. All but the
/// first are absent in a replay that runs by the recording's clock.
struct Instants {
  Timestamp exposed_at;                  ///< middle of the exposure, mean of the views
  std::optional<Timestamp> received_at;  ///< the last image of the set was here
  std::optional<Timestamp> detected_at;  ///< the last image's blobs were found
  std::optional<Timestamp> fused_at;     ///< the row was through
  std::optional<Timestamp> sent_at;      ///< handed to the transport
};

/// One camera's share in a set.
struct ViewStatus {
  CameraId camera;
  std::uint64_t frame_number = 0;  ///< the camera's own count
  Duration skew{};                 ///< its exposure from the set's mean
  std::uint32_t blobs = 0;
};

/// A marker that has no name.
struct UnlabelledMarker {
  TrackId track;
  WorldPoint position;
  double residual_px = 0.0;
  std::uint32_t cameras = 0;
};

/// All that the daemon knows about one instant.
struct Snapshot {
  std::uint64_t number = 0;               ///< counts the sets of this run: a gap is a set that was passed over
  std::uint32_t description_version = 0;  ///< that this snapshot's indices refer to
  Instants instants;
  std::uint32_t expected_views = 0;
  BoundedVector<ViewStatus, kMaxCameras> views;
  Labels labels;
  Poses poses;
  BoundedVector<UnlabelledMarker, kMaxMarkers> unlabelled;
};

}  // namespace mocap
