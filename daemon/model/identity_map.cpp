#include "model/identity_map.h"

#include <algorithm>
#include <tuple>

#include "base/expects.h"

namespace mocap {
namespace {

// A label stays on a track that fewer than two cameras see for this long after the last view. Chosen by hand; not yet
// measured.
constexpr Duration kLabelRetention = std::chrono::milliseconds(150);

// A bearing-only observation is recent for this many images of its camera: about as long as two blobs hide each other
// when their markers cross. Chosen by hand; not yet measured.
constexpr std::uint32_t kMaxBearingAge_images = 24;

template <class Identities>
const TrackIdentity* find_track(const Identities& identities, TrackId track) {
  const auto* found = std::lower_bound(identities.begin(), identities.end(), track,
                                       [](const TrackIdentity& one, TrackId sought) { return one.track < sought; });
  return found != identities.end() && found->track == track ? found : nullptr;
}

}  // namespace

IdentityMap::IdentityMap(std::size_t camera_count) : view_counts_(kMaxMarkers, 0), cameras_(camera_count) {
  for (CameraIdentities& camera : cameras_) camera.blob_tracks.resize(kBlobTrackSlots);
  track_index_.reserve(kMaxMarkers);
}

void IdentityMap::adopt(const IdentityMap& before, const Handover& handover) {
  if (!handover.poses) return;
  for (const TrackIdentity& one : before.tracks_) {
    TrackIdentity& adopted = tracks_.push_back(one);
    adopted.label = handover.now(one.label);
    if (!adopted.label.names_something()) tracks_.pop_back();
  }
  for (std::size_t i = 0; i < cameras_.size() && i < handover.cameras.size(); ++i) {
    const CameraId camera = handover.cameras[i];
    if (camera.value < before.cameras_.size()) adopt_camera(cameras_[i], before.cameras_[camera.value], handover);
  }
}

void IdentityMap::adopt_camera(CameraIdentities& camera, const CameraIdentities& before, const Handover& handover) {
  camera = before;
  for (BlobTrackIdentity& blob_track : camera.blob_tracks) blob_track.label = handover.now(blob_track.label);
  camera.recent_bearings.clear();
  for (const RecentBearing& one : before.recent_bearings) {
    const Label label = handover.now(one.label);
    if (label.names_something()) camera.recent_bearings.push_back({label, one.image});
  }
}

bool IdentityMap::has_label(TrackId track) const {
  const TrackIdentity* identity = find(track);
  return identity != nullptr && !identity->is_retained;
}

const TrackIdentity* IdentityMap::find(TrackId track) const { return find_track(tracks_, track); }

const TrackIdentity* IdentityMap::previous(TrackId track) const { return find_track(previous_tracks_, track); }

const Predictions& IdentityMap::predict(const FrameSet& frames, const PredictedMarkers& by_tracks,
                                        const PredictedMarkers& by_bodies) {
  MOCAP_EXPECTS(&by_tracks != &predictions_.markers);
  predictions_.at = frames.exposed_at;
  predictions_.cameras = 0;
  for (const BlobFrame* view : frames.views) predictions_.cameras |= bit_of(view->camera);
  predictions_.markers = by_tracks;
  label_tracks();
  join_bodies(by_bodies);
  predictions_.views.clear();
  // An image of a set without predictions identifies nothing and is not counted.
  if (predictions_.markers.empty()) return predictions_;
  index_tracks();
  predictions_.views.resize(frames.views.size());
  for (std::size_t view = 0; view < frames.views.size(); ++view) {
    identify_blobs(*frames.views[view], predictions_.views[view]);
  }
  return predictions_;
}

void IdentityMap::label_tracks() {
  for (PredictedMarker& marker : predictions_.markers) {
    if (const TrackIdentity* identity = find(marker.track)) marker.label = identity->label;
  }
}

// A label without a track gets the skeleton's prediction. A track with a retained label gets it if the skeleton is more
// certain.
void IdentityMap::join_bodies(const PredictedMarkers& by_bodies) {
  const std::size_t track_count = predictions_.markers.size();
  for (const PredictedMarker& by_body : by_bodies) {
    const auto has_this_label = [&](const PredictedMarker& marker) { return marker.label == by_body.label; };
    auto* const end = predictions_.markers.begin() + track_count;
    auto* const by_track = std::find_if(predictions_.markers.begin(), end, has_this_label);
    if (by_track == end) {
      if (!predictions_.markers.try_push_back(by_body)) return;
      continue;
    }
    const TrackIdentity* identity = find(by_track->track);
    if (identity != nullptr && identity->is_retained &&
        by_body.covariance_m2.trace() < by_track->covariance_m2.trace()) {
      by_track->position = by_body.position;
      by_track->covariance_m2 = by_body.covariance_m2;
    }
  }
}

void IdentityMap::index_tracks() {
  track_index_.clear();
  for (std::uint32_t m = 0; m < predictions_.markers.size(); ++m) {
    const TrackId track = predictions_.markers[m].track;
    if (track.names_something()) track_index_.push_back({track, m});
  }
  if (!std::ranges::is_sorted(track_index_, {}, &TrackIndex::track))
    std::ranges::sort(track_index_, {}, &TrackIndex::track);
}

void IdentityMap::identify_blobs(const BlobFrame& frame, BlobIdentities& into) {
  MOCAP_EXPECTS(frame.camera.value < cameras_.size());
  CameraIdentities& camera = cameras_[frame.camera.value];
  ++camera.image;
  into.marker_of_blob.clear();
  into.recent_bearing_only.clear();
  const auto has_track = [](const Blob& blob) { return blob.track.names_something(); };
  if (std::none_of(frame.blobs.begin(), frame.blobs.end(), has_track)) return;
  for (const Blob& blob : frame.blobs) into.marker_of_blob.push_back(identify_blob(camera, blob.track));
  append_recent_bearings(camera, into);
}

std::uint32_t IdentityMap::identify_blob(CameraIdentities& camera, BlobTrackId blob_track) const {
  if (!blob_track.names_something()) return BlobIdentities::kUnknown;
  BlobTrackIdentity& slot = slot_of(camera, blob_track);
  if (slot.blob_track != blob_track) return BlobIdentities::kUnknown;
  const bool is_continuous = slot.image + 1 == camera.image;
  slot.image = camera.image;
  if (!is_continuous) slot.sets = 0;
  if (slot.sets < kEstablishedSets) return BlobIdentities::kUnknown;
  const auto found = std::ranges::lower_bound(track_index_, slot.track, {}, &TrackIndex::track);
  if (found != track_index_.end() && found->track == slot.track) return found->marker;
  return marker_with(slot.label);
}

void IdentityMap::append_recent_bearings(CameraIdentities& camera, BlobIdentities& into) const {
  auto& recent = camera.recent_bearings;
  const auto is_old = [&](const RecentBearing& one) { return camera.image - one.image > kMaxBearingAge_images; };
  const auto* const end = std::remove_if(recent.begin(), recent.end(), is_old);
  while (recent.end() != end) recent.pop_back();
  for (const RecentBearing& one : recent) {
    const std::uint32_t marker = marker_with(one.label);
    if (marker != BlobIdentities::kUnpredicted) into.recent_bearing_only.push_back(marker);
  }
}

std::uint32_t IdentityMap::marker_with(Label label) const {
  const auto* const found = std::ranges::find(predictions_.markers, label, &PredictedMarker::label);
  if (!label.names_something() || found == predictions_.markers.end()) return BlobIdentities::kUnpredicted;
  return static_cast<std::uint32_t>(found - predictions_.markers.begin());
}

IdentityMap::BlobTrackIdentity& IdentityMap::slot_of(CameraIdentities& camera, BlobTrackId blob_track) const {
  return camera.blob_tracks[blob_track.value % kBlobTrackSlots];
}

void IdentityMap::update(const FrameSet& frames, const Matches& matches, const Labels& labels) {
  update_blob_tracks(frames, matches);
  previous_tracks_ = tracks_;
  update_labels(labels);
  retain_labels(matches);
  std::sort(tracks_.begin(), tracks_.end(), [](const TrackIdentity& a, const TrackIdentity& b) {
    return std::tie(a.track, a.label) < std::tie(b.track, b.label);
  });
}

void IdentityMap::update_blob_tracks(const FrameSet& frames, const Matches& matches) {
  constexpr std::size_t kSureViews = 3;
  for (const Match& match : matches.matches) {
    if (match.prediction == Match::kNew || match.sightings.size() < kSureViews) continue;
    for (const BlobRef& sighting : match.sightings) {
      const BlobIdentities& known = predictions_.views[sighting.view];
      // A 2D track that is established as this marker's stays as it is; a shared blob is no evidence about its 2D
      // track.
      const bool is_known =
          sighting.blob < known.marker_of_blob.size() && known.marker_of_blob[sighting.blob] == match.prediction;
      if (sighting.is_shared || is_known) continue;
      const BlobFrame& frame = *frames.views[sighting.view];
      associate(cameras_[frame.camera.value], frame.blobs[sighting.blob].track, predictions_.markers[match.prediction]);
    }
  }
  for (const BearingOnlyObservation& bearing_only : matches.bearing_only) {
    if (bearing_only.is_ambiguous) continue;
    const BlobFrame& frame = *frames.views[bearing_only.sighting.view];
    const PredictedMarker& marker = predictions_.markers[bearing_only.prediction];
    CameraIdentities& camera = cameras_[frame.camera.value];
    note_bearing_only(camera, marker.label);
    associate(camera, frame.blobs[bearing_only.sighting.blob].track, marker);
  }
}

void IdentityMap::associate(CameraIdentities& camera, BlobTrackId blob_track, const PredictedMarker& marker) const {
  if (!blob_track.names_something() || !(marker.track.names_something() || marker.label.names_something())) return;
  BlobTrackIdentity& slot = slot_of(camera, blob_track);
  const bool same_track = marker.track.names_something() && slot.track == marker.track;
  const bool same_label = marker.label.names_something() && slot.label == marker.label;
  if (slot.blob_track != blob_track || !(same_track || same_label)) {
    slot = {blob_track, marker.track, marker.label, 0, camera.image};
  }
  slot.track = marker.track;
  slot.label = marker.label;
  slot.sets = std::min(slot.sets + 1, kEstablishedSets);
}

void IdentityMap::note_bearing_only(CameraIdentities& camera, Label label) {
  if (!label.names_something()) return;
  auto& recent = camera.recent_bearings;
  auto* const known = std::ranges::find(recent, label, &RecentBearing::label);
  if (known != recent.end()) {
    known->image = camera.image;
  } else {
    static_cast<void>(recent.try_push_back({label, camera.image}));
  }
}

// The labels that the labeller gave to tracks.
void IdentityMap::update_labels(const Labels& labels) {
  tracks_.clear();
  for (const SubjectLabels& subject : labels) {
    for (std::uint32_t i = 0; i < subject.markers.size(); ++i) {
      const TrackId track = subject.markers[i].track;
      if (!track.names_something() || tracks_.size() == kMaxMarkers) continue;
      const Label label{subject.subject, i};
      const TrackIdentity* before = previous(track);
      const Timestamp since = before != nullptr && before->label == label ? before->since : predictions_.at;
      tracks_.push_back({track, label, since, predictions_.at, false});
    }
  }
}

// A label that left its track, because fewer than two cameras see the marker, stays the label of that track's
// predictions until another track gets the label or the track gets another label.
void IdentityMap::retain_labels(const Matches& matches) {
  std::fill(view_counts_.begin(), view_counts_.end(), std::uint8_t{0});
  for (const BearingOnlyObservation& bearing_only : matches.bearing_only) view_counts_[bearing_only.prediction] = 1;
  for (const Match& match : matches.matches) {
    if (match.prediction != Match::kNew) view_counts_[match.prediction] = 2;
  }
  const std::size_t labelled_count = tracks_.size();
  for (std::size_t m = 0; m < predictions_.markers.size(); ++m) {
    const PredictedMarker& marker = predictions_.markers[m];
    if (!marker.label.names_something() || !marker.track.names_something() || view_counts_[m] == 2) continue;
    const auto is_taken = [&](const TrackIdentity& one) {
      return one.label == marker.label || one.track == marker.track;
    };
    if (std::any_of(tracks_.begin(), tracks_.begin() + labelled_count, is_taken)) continue;
    const TrackIdentity* before = previous(marker.track);
    // The set in which the label left the track counts as an observation.
    const bool was_retained = before != nullptr && before->is_retained;
    const Timestamp observed_at = was_retained && view_counts_[m] == 0 ? before->observed_at : predictions_.at;
    if (!(predictions_.at - observed_at < kLabelRetention)) continue;
    const Timestamp since = before != nullptr ? before->since : predictions_.at;
    static_cast<void>(tracks_.try_push_back({marker.track, marker.label, since, observed_at, true}));
  }
}

}  // namespace mocap
