#pragma once

#include <Eigen/Core>
#include <cstdint>

#include "base/bounded_vector.h"
#include "base/time.h"
#include "model/bounds.h"
#include "model/camera_bits.h"
#include "model/ids.h"
#include "model/points.h"

namespace mocap {

/// The predicted position of one known marker: a marker that has a 3D track, or a label whose position the skeleton
/// predicts.
struct PredictedMarker {
  WorldPoint position;
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Identity();
  TrackId track;              ///< names nothing if only the skeleton predicts the marker
  Label label;                ///< names nothing if the track has no label
  std::uint32_t cameras = 0;  ///< number of cameras that saw the marker in the last set
};

using PredictedMarkers = BoundedVector<PredictedMarker, kMaxMarkers>;

/// The identity of the blobs of one view, from the 2D tracks of the blobs. Both lists have indices in
/// Predictions::markers.
struct BlobIdentities {
  static constexpr std::uint32_t kUnknown = 0xFFFF'FFFF;      ///< the 2D track is new, or its marker is not established
  static constexpr std::uint32_t kUnpredicted = 0xFFFF'FFFE;  ///< the 2D track belongs to a marker without a prediction
  static constexpr std::size_t kMaxRecent = 64;               ///< bearing-only markers that one camera remembers

  BoundedVector<std::uint32_t, kMaxBlobs> marker_of_blob;  ///< by blob; empty if no blob of the view has a 2D track
  BoundedVector<std::uint32_t, kMaxRecent> recent_bearing_only;  ///< markers that this camera alone saw a moment ago
};

/// The predictions of all markers, before the blobs of a set are associated.
struct Predictions {
  Timestamp at;
  CameraBits cameras = 0;  ///< cameras that have an image in the set, if they are known
  PredictedMarkers markers;
  BoundedVector<BlobIdentities, kMaxCameras> views;  ///< by view of the set; empty: no 2D track is known
};

}  // namespace mocap
