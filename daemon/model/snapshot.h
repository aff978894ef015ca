#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "base/bounded_vector.h"
#include "base/time.h"
#include "model/camera_bits.h"
#include "model/clock/timecode.h"
#include "model/sighting.h"
#include "model/subject_state.h"

namespace mocap {

/// The five instants of a snapshot, on the host's monotonic clock, each taken by the thread that reached it. All but
/// the first are absent in a replay that runs by the recording's clock.
struct Instants {
  Timestamp exposed_at;                  ///< middle of the exposure, mean of the views
  std::optional<Timestamp> received_at;  ///< arrival of the set's last image
  std::optional<Timestamp> detected_at;  ///< detection of the set's last image ended
  std::optional<Timestamp> fused_at;     ///< the pipeline ended
  std::optional<Timestamp> sent_at;      ///< handed to the transport
};

/// One camera's contribution to a set.
struct ViewStatus {
  CameraId camera;
  std::uint64_t frame_number = 0;  ///< the camera's own count
  Duration skew{};                 ///< offset of its exposure from the set's mean
  std::uint32_t blobs = 0;
};

/// A marker without a label.
struct UnlabelledMarker {
  TrackId track;
  WorldPoint position;
  double residual_px = 0.0;
  std::uint32_t cameras = 0;
  CameraBits seen_by = 0;  ///< these cameras, if they are known
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Identity();
};

/// The result of the pipeline for one instant.
struct Snapshot {
  std::uint64_t number = 0;               ///< number of the set in this run: a gap is a set that was skipped
  std::uint32_t description_version = 0;  ///< version of the description that this snapshot's indices refer to
  Instants instants;
  std::optional<Timecode> timecode;  ///< of the exposure; empty: the run has no timecode now
  std::uint32_t expected_views = 0;
  std::uint32_t delivering_cameras = 0;  ///< cameras that the set expected images of; only takes have it; 0: unknown
  BoundedVector<ViewStatus, kMaxCameras> views;
  Labels labels;
  Poses poses;
  BoundedVector<UnlabelledMarker, kMaxMarkers> unlabelled;
};

}  // namespace mocap
