#include "stages/fuse.h"

#include <algorithm>

namespace mocap::stages {

Fusion::Fusion(FusionParts parts, std::uint32_t camera_count) : parts_(std::move(parts)) {
  MOCAP_EXPECTS(parts_.matcher && parts_.triangulator && parts_.tracker && parts_.labeller && parts_.solver);
  snapshot_.expected_views = camera_count;
  snapshot_.description_version = 1;
}

Snapshot& Fusion::step(const FrameSet& frames) {
  const Expected& expected = expect(frames.exposed_at);
  const Matches& matches = parts_.matcher->match(frames, expected);
  const Markers& markers = parts_.triangulator->triangulate(frames, matches);
  const TrackedMarkers& tracked = parts_.tracker->step(markers, expected, matches.lone);
  snapshot_.labels = parts_.labeller->label(tracked, expected);
  learn_fit();
  snapshot_.poses = parts_.solver->solve(snapshot_.labels, frames.exposed_at);
  learn_names();
  if (parts_.refiner && !refined_) {
    refined_ = parts_.refiner->step(snapshot_.labels, snapshot_.poses, frames.exposed_at);
  }

  snapshot_.number = frames.number;
  describe_views(frames);
  list_the_unlabelled(tracked);
  return snapshot_;
}

const Expected& Fusion::expect(Timestamp at) {
  expected_.at = at;
  expected_.markers.clear();
  parts_.tracker->predict(at, expected_);
  name_the_tracks();

  // A name whose track is gone is expected where the body says.
  told_by_bodies_.at = at;
  told_by_bodies_.markers.clear();
  parts_.solver->predict(at, told_by_bodies_);
  const std::size_t tracks = expected_.markers.size();
  for (const ExpectedMarker& told : told_by_bodies_.markers) {
    const auto borne = [&](const ExpectedMarker& known) { return known.label == told.label; };
    if (std::none_of(expected_.markers.begin(), expected_.markers.begin() + tracks, borne)) {
      if (!expected_.markers.try_push_back(told)) break;
    }
  }
  return expected_;
}

void Fusion::name_the_tracks() {
  for (ExpectedMarker& known : expected_.markers) {
    const auto by_track = [](const BornBy& name, TrackId track) { return name.first < track; };
    const auto* found = std::lower_bound(names_.begin(), names_.end(), known.track, by_track);
    if (found != names_.end() && found->first == known.track) known.label = found->second;
  }
}

void Fusion::learn_fit() {
  fit_ = parts_.labeller->take_fit();
  if (fit_) {
    if (parts_.refiner) parts_.refiner->recognised(*fit_);
    if (refined_ && refined_->subject == fit_->subject) refined_.reset();
  } else if (refined_) {
    fit_ = refined_;
    refined_.reset();
    parts_.labeller->refit(*fit_);
  } else {
    return;
  }
  fit_->description_version = ++snapshot_.description_version;
  parts_.solver->refit(*fit_);
}

void Fusion::learn_names() {
  names_.clear();
  for (const SubjectLabels& subject : snapshot_.labels) {
    for (std::uint32_t i = 0; i < subject.markers.size(); ++i) {
      const TrackId track = subject.markers[i].track;
      if (track.names_something()) static_cast<void>(names_.try_push_back({track, Label{subject.subject, i}}));
    }
  }
  std::sort(names_.begin(), names_.end());
}

void Fusion::describe_views(const FrameSet& frames) {
  Instants& instants = snapshot_.instants;
  instants =
      Instants{.exposed_at = frames.exposed_at, .received_at = {}, .detected_at = {}, .fused_at = {}, .sent_at = {}};
  snapshot_.views.clear();
  for (const BlobFrame* view : frames.views) {
    snapshot_.views.push_back({view->camera, view->number, view->exposed_at - frames.exposed_at,
                               static_cast<std::uint32_t>(view->blobs.size())});
    instants.received_at = std::max(instants.received_at.value_or(view->received_at), view->received_at);
    instants.detected_at = std::max(instants.detected_at.value_or(view->detected_at), view->detected_at);
  }
}

void Fusion::list_the_unlabelled(const TrackedMarkers& tracked) {
  snapshot_.unlabelled.clear();
  for (const TrackedMarker& marker : tracked) {
    const auto by_track = [](const BornBy& name, TrackId track) { return name.first < track; };
    const auto* found = std::lower_bound(names_.begin(), names_.end(), marker.id, by_track);
    const bool named = found != names_.end() && found->first == marker.id;
    if (named || marker.state != TrackState::Confirmed) continue;
    snapshot_.unlabelled.push_back({marker.id, marker.position, marker.residual_px, marker.cameras});
  }
}

}  // namespace mocap::stages
