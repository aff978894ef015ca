#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>

#include "base/archive.h"
#include "base/bounded_vector.h"
#include "base/time.h"
#include "model/blob.h"
#include "model/camera_bits.h"
#include "model/ids.h"
#include "model/points.h"
#include "model/predictions.h"

namespace mocap {

/// The images of all cameras exposed at one instant. The views are borrowed from the aligner until its next call.
struct FrameSet {
  std::uint64_t number = 0;                            ///< number of the set in this run
  Timestamp exposed_at;                                ///< mean of the views' exposures
  BoundedVector<const BlobFrame*, kMaxCameras> views;  ///< at most one a camera, in the order of CameraId
  std::uint32_t expected_views = 0;                    ///< number of expected cameras
};

/// A blob of a frame set: `views[view]->blobs[blob]`, and the marker's offset in it if the blob is merged.
struct BlobRef {
  std::uint16_t view = 0;
  std::uint16_t blob = 0;
  float off_x_px = 0.0F;  ///< from the blob's centroid to the marker
  float off_y_px = 0.0F;
  float sigma_px = 0.0F;   ///< standard deviation of that position, each axis; 0: the blob's own
  bool is_shared = false;  ///< the blob is a merged blob of several markers
};

/// The triangulation of a match, if the matcher has computed it.
struct Triangulation {
  WorldPoint point;
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Identity();  ///< from the sightings' sigma_px
  double rms_px = 0.0;                                          ///< over the sightings
  /// Every residual is at most sqrt(floor_px^2 + (sigmas * sigma_px)^2).
  double floor_px = 0.0;
  double sigmas = 0.0;
};

/// The blobs of one marker in several cameras.
struct Match {
  static constexpr std::uint32_t kNew = 0xFFFF'FFFF;

  std::uint32_t prediction = kNew;  ///< index in Predictions::markers, or kNew
  bool by_blob_tracks =
      false;  ///< the 2D tracks of at least two of its blobs were assigned to this predicted marker before
  std::optional<Triangulation> triangulation;  ///< the triangulated position; empty: not computed
  BoundedVector<BlobRef, kMaxCameras> sightings;
};

/// The blob of a predicted marker that exactly one camera sees: a direction without depth.
struct BearingOnlyObservation {
  std::uint32_t prediction = 0;  ///< index in Predictions::markers
  BlobRef sighting;
  WorldPoint eye;                                        ///< origin of the ray: the camera's centre
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< direction of the ray in the world; unit
  double sigma_rad = 0.0;                                ///< standard deviation across the ray, each axis
  bool is_ambiguous = false;  ///< another predicted marker is about as likely the source of the blob
};

/// The ray of a labelled marker that exactly one camera sees.
struct LabelledBearing {
  Label label;
  CameraId camera;
  WorldPoint eye;
  Eigen::Vector3d direction = Eigen::Vector3d::UnitZ();  ///< unit
  double sigma_rad = 0.0;                                ///< standard deviation across the ray, each axis
};

using LabelledBearings = BoundedVector<LabelledBearing, kMaxMarkers>;

/// A point where rays of two cameras meet that is no match, because the rays may meet by chance: they have other
/// partners too, or a third camera could see the point and does not. Candidates share blobs, and most of them are
/// clutter.
struct CandidatePoint {
  WorldPoint position;
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Identity();
};

using CandidatePoints = BoundedVector<CandidatePoint, kMaxMarkers>;

/// The blobs of one instant, grouped by marker.
struct Matches {
  BoundedVector<Match, kMaxMarkers> matches;
  BoundedVector<BearingOnlyObservation, kMaxMarkers>
      bearing_only;  ///< predicted markers without a match; their blobs are in no match
  std::uint32_t unmatched_blobs = 0;
  std::uint32_t dropped = 0;    ///< over kMaxMarkers
  std::uint32_t seen_once = 0;  ///< predicted markers with a possible blob in one camera only
  std::uint32_t skipped = 0;    ///< hypotheses left untried, because the work for one set is bounded
  CandidatePoints candidates;   ///< evidence for identification only; their blobs are in no match
};

/// A triangulated marker.
struct Marker {
  WorldPoint position;
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Identity();
  double residual_px = 0.0;                ///< rms over its sightings
  std::uint32_t cameras = 0;               ///< number of cameras that see it
  std::uint32_t match = 0;                 ///< index in Matches::matches
  std::uint32_t prediction = Match::kNew;  ///< index in Predictions::markers, or kNew
  bool by_blob_tracks = false;             ///< as in its match
  CameraBits seen_by = 0;                  ///< the cameras that see it
};

using Markers = BoundedVector<Marker, kMaxMarkers>;

enum class TrackState {
  Tentative,  ///< not yet confirmed
  Confirmed,  ///< measured in this set
  Coasting,   ///< not measured in this set, predicted by its motion
  Candidate,  ///< measured in this set as a CandidatePoint: it may be clutter, and is not predicted for the next set
};

/// A tracked marker, labelled or not.
struct TrackedMarker {
  TrackId id;
  TrackState state = TrackState::Tentative;
  WorldPoint position;
  Eigen::Vector3d velocity_m_s = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Identity();  ///< covariance of the position
  double residual_px = 0.0;                                     ///< residual of this set's measurement
  std::uint32_t cameras = 0;                                    ///< number of cameras that see it now; 0 while coasting
  CameraBits seen_by = 0;                                       ///< these cameras; 0 for a Candidate, too
  std::uint32_t age_sets = 0;                                   ///< sets since track initiation
  std::uint32_t missed_sets = 0;  ///< since the last measurement; only sets with two cameras that saw the marker last
  std::uint32_t prediction = Match::kNew;  ///< of its measurement: index in Predictions::markers, or kNew

  void archive(Archive& members) {
    members(id, state, position.v, velocity_m_s, covariance_m2, residual_px, cameras, seen_by, age_sets, missed_sets,
            prediction);
  }
};

using TrackedMarkers = BoundedVector<TrackedMarker, kMaxMarkers>;

}  // namespace mocap
