#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/archive.h"
#include "base/bounded_vector.h"
#include "base/time.h"
#include "model/handover.h"
#include "model/predictions.h"
#include "model/sighting.h"
#include "model/subject_state.h"

namespace mocap {

/// The label of one 3D track.
struct TrackIdentity {
  TrackId track;
  Label label;
  Timestamp since;  ///< the set in which the track got this label
  /// The last set in which the labeller gave the label to the track, or a camera saw the marker.
  Timestamp observed_at;
  /// The labeller took the label from the track, because fewer than two cameras see the marker.
  bool is_retained = false;

  void archive(Archive& members) { members(track, label, since, observed_at, is_retained); }
};

/// The memory of marker identity between frame sets: which label, which 3D track and which 2D tracks belong together.
/// It alone predicts by identity. The labeller remembers besides which track had a label, as a hint for its decision.
///
/// A set begins with `predict`, which joins the predictions of the 3D tracks and of the skeletons with the remembered
/// identities. It ends with `update`, which learns the identities from the matches and the labels of the set.
///
/// Labels of 3D tracks: the labels of the last set, and for 150 ms after the last view the labels of tracks that fewer
/// than two cameras see (*retained* labels).
///
/// 2D tracks: a 2D track is established as a marker's after three sets in which three or more views agreed, or in which
/// one camera alone saw the marker without ambiguity. An image in which the 2D track is missing ends that. The marker
/// is found again by its 3D track, or by its label if that 3D track has ended.
///
/// One thread. Never allocates after construction.
class IdentityMap {
 public:
  explicit IdentityMap(std::size_t camera_count);

  /// The predictions for a set. `by_tracks`: of the 3D tracks, in the order of their ids. `by_bodies`: of the
  /// skeletons, by label; used if no track has the label, or if the track has a retained label and the skeleton is more
  /// certain. The result is borrowed until the next call.
  const Predictions& predict(const FrameSet& frames, const PredictedMarkers& by_tracks,
                             const PredictedMarkers& by_bodies);

  /// Learns from the set for which the last `predict` was. The matches refer to its predictions.
  void update(const FrameSet& frames, const Matches& matches, const Labels& labels);

  /// Takes over the identities of the subjects and cameras that continue, if poses continue. Call before the first
  /// `predict`.
  void adopt(const IdentityMap& before, const Handover& handover);

  /// Writes the identities, or takes them over from a map for as many cameras. Call between two sets.
  void archive(Archive& members) { members(tracks_, cameras_); }

  std::size_t camera_count() const noexcept { return cameras_.size(); }

  /// Whether the labeller gave this track a label in the last set.
  bool has_label(TrackId track) const;

 private:
  // Slots of the 2D tracks of one camera, by the last bits of the id: a power of two. A newer 2D track replaces the one
  // in its slot.
  static constexpr std::size_t kBlobTrackSlots = 1024;
  // Sets until a 2D track is established as a marker's.
  static constexpr std::uint32_t kEstablishedSets = 3;

  struct BlobTrackIdentity {
    BlobTrackId blob_track;
    TrackId track;  // this and the label: one of them may name nothing
    Label label;
    std::uint32_t sets = 0;   // in which the association was seen, at most kEstablishedSets
    std::uint32_t image = 0;  // the last image that showed the 2D track
  };
  struct RecentBearing {
    Label label;
    std::uint32_t image = 0;  // the last image in which this camera alone saw the label's marker
  };
  struct CameraIdentities {
    std::vector<BlobTrackIdentity> blob_tracks;  // by slot
    BoundedVector<RecentBearing, BlobIdentities::kMaxRecent> recent_bearings;
    std::uint32_t image = 0;  // number of images so far

    void archive(Archive& members) { members(blob_tracks, recent_bearings, image); }
  };
  struct TrackIndex {
    TrackId track;
    std::uint32_t marker;  // index in Predictions::markers
  };

  static void adopt_camera(CameraIdentities& camera, const CameraIdentities& before, const Handover& handover);
  const TrackIdentity* find(TrackId track) const;
  void label_tracks();
  void join_bodies(const PredictedMarkers& by_bodies);
  void index_tracks();
  void identify_blobs(const BlobFrame& frame, BlobIdentities& into);
  std::uint32_t identify_blob(CameraIdentities& camera, BlobTrackId blob_track) const;
  void append_recent_bearings(CameraIdentities& camera, BlobIdentities& into) const;
  std::uint32_t marker_with(Label label) const;
  BlobTrackIdentity& slot_of(CameraIdentities& camera, BlobTrackId blob_track) const;
  void update_blob_tracks(const FrameSet& frames, const Matches& matches);
  void associate(CameraIdentities& camera, BlobTrackId blob_track, const PredictedMarker& marker) const;
  static void note_bearing_only(CameraIdentities& camera, Label label);
  void update_labels(const Labels& labels);
  void retain_labels(const Matches& matches);
  const TrackIdentity* previous(TrackId track) const;

  Predictions predictions_;
  BoundedVector<TrackIdentity, 2 * kMaxMarkers> tracks_;  // sorted by track
  BoundedVector<TrackIdentity, 2 * kMaxMarkers> previous_tracks_;
  std::vector<std::uint8_t> view_counts_;  // by predicted marker, in this set: 0, 1, or 2 for two and more
  std::vector<CameraIdentities> cameras_;
  std::vector<TrackIndex> track_index_;  // of the predictions, sorted by track
};

}  // namespace mocap
