#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>

#include "base/bounded_vector.h"
#include "base/time.h"
#include "model/blob.h"
#include "model/ids.h"
#include "model/points.h"

namespace mocap {

/// What the cameras saw at one instant. The views are borrowed from the aligner until its next call.
struct FrameSet {
  std::uint64_t number = 0;                            ///< counts the sets of this run
  Timestamp exposed_at;                                ///< mean of the views' exposures
  BoundedVector<const BlobFrame*, kMaxCameras> views;  ///< at most one a camera, in the order of CameraId
  std::uint32_t expected_views = 0;                    ///< cameras that should have delivered
};

/// A marker that is known to be somewhere: a living track, or a name whose place the body tells.
struct ExpectedMarker {
  WorldPoint position;
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Identity();
  TrackId track;              ///< names nothing where only the body tells
  Label label;                ///< names nothing where the track has no name
  std::uint32_t cameras = 0;  ///< that saw it in the last set
};

/// Where each known marker should be at one instant.
struct Expected {
  Timestamp at;
  BoundedVector<ExpectedMarker, kMaxMarkers> markers;
};

/// A blob of a frame set: `views[view]->blobs[blob]`; and where in it the marker is, when it is more than one's.
struct BlobRef {
  std::uint16_t view = 0;
  std::uint16_t blob = 0;
  float off_x_px = 0.0F;  ///< from the blob's centroid to the marker
  float off_y_px = 0.0F;
  float sigma_px = 0.0F;  ///< standard deviation of that place, each axis; 0: the blob's own
};

/// Where the sightings of a match meet, as the one who matched them found it.
struct Triangulation {
  WorldPoint point;
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Identity();  ///< as the sightings' sigma_px promise it
  double rms_px = 0.0;                                          ///< over the sightings
  /// No sighting lies farther off than the root of floor_px^2 + (sigmas sigma_px)^2.
  double floor_px = 0.0;
  double sigmas = 0.0;
};

/// The blobs that are one marker seen from several cameras.
struct Match {
  static constexpr std::uint32_t kNew = 0xFFFF'FFFF;

  std::uint32_t expected = kNew;  ///< index in Expected::markers, or kNew
  bool by_blob_tracks = false;    ///< the 2D tracks of two or more of its blobs were this expected marker's before
  std::optional<Triangulation> triangulation;  ///< where the sightings meet; nothing: not told
  BoundedVector<BlobRef, kMaxCameras> sightings;
};

/// The blob of an expected marker that one camera alone sees: it tells a ray, and no depth.
struct BearingOnlyObservation {
  std::uint32_t expected = 0;  ///< index in Expected::markers
  BlobRef sighting;
  WorldPoint eye;                                        ///< where the ray begins: the camera's centre
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< of the ray, in the world; unit
  double sigma_rad = 0.0;                                ///< standard deviation of each axis across it
};

/// A ray of the one camera that sees a named marker: what it tells of a body.
struct LabelledBearing {
  Label label;
  CameraId camera;
  WorldPoint eye;
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< unit
  double sigma_rad = 0.0;                                ///< standard deviation of each axis across it
};

using LabelledBearings = BoundedVector<LabelledBearing, kMaxMarkers>;

/// One instant's blobs, gathered by marker.
struct Matches {
  BoundedVector<Match, kMaxMarkers> matches;
  BoundedVector<BearingOnlyObservation, kMaxMarkers>
      bearing_only;  ///< expected markers of which no match is; in no match's blobs
  std::uint32_t unmatched_blobs = 0;
  std::uint32_t dropped = 0;    ///< over kMaxMarkers
  std::uint32_t seen_once = 0;  ///< expected markers of which one camera alone may have a blob
  std::uint32_t skipped = 0;    ///< hypotheses left untried, because the work for one set is bounded
};

/// A marker as triangulation found it.
struct Marker {
  WorldPoint position;
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Identity();
  double residual_px = 0.0;              ///< rms over its sightings
  std::uint32_t cameras = 0;             ///< that see it
  std::uint32_t match = 0;               ///< index in Matches::matches
  std::uint32_t expected = Match::kNew;  ///< index in Expected::markers, or kNew
  bool by_blob_tracks = false;           ///< as its match
};

using Markers = BoundedVector<Marker, kMaxMarkers>;

enum class TrackState {
  Tentative,  ///< seen too few times to be believed
  Confirmed,  ///< seen in this set
  Coasting,   ///< not seen in this set, carried on by its motion
};

/// A marker over time, named or not.
struct TrackedMarker {
  TrackId id;
  TrackState state = TrackState::Tentative;
  WorldPoint position;
  Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Identity();  ///< of the position
  double residual_px = 0.0;                                     ///< of this set's measurement
  std::uint32_t cameras = 0;                                    ///< that see it now; 0 while coasting
  std::uint32_t age_sets = 0;                                   ///< since it was born
  std::uint32_t missed_sets = 0;                                ///< since it was last seen
  Label expected_label;  ///< the name of the expectation that its measurement was matched to, where it had one
};

using TrackedMarkers = BoundedVector<TrackedMarker, kMaxMarkers>;

}  // namespace mocap
