#include "fusion/fusion.h"

#include <algorithm>
#include <tuple>

namespace mocap::fusion {
namespace {

// A hidden marker's track that no camera has seen for so long may see another next.
constexpr Duration kLabelRetention = std::chrono::milliseconds(150);

// In a list that is sorted by track.
template <class Names>
auto find(const Names& names, TrackId track) -> decltype(names.data()) {
  const auto by_track = [](const auto& name, TrackId sought) { return name.track < sought; };
  const auto* found = std::lower_bound(names.begin(), names.end(), track, by_track);
  return found != names.end() && found->track == track ? found : nullptr;
}

template <class Names>
void sort_by_track(Names& names) {
  std::sort(names.begin(), names.end(),
            [](const auto& a, const auto& b) { return std::tie(a.track, a.label) < std::tie(b.track, b.label); });
}

}  // namespace

Fusion::Fusion(FusionParts parts, std::uint32_t camera_count) : parts_(std::move(parts)) {
  MOCAP_EXPECTS(parts_.matcher && parts_.triangulator && parts_.tracker && parts_.labeller && parts_.solver);
  snapshot_.expected_views = camera_count;
  snapshot_.description_version = 1;
}

void Fusion::refit(const SubjectFit& fit) {
  if (parts_.refiner) parts_.refiner->recognised(fit);
  pending_fit_ = fit;
}

void Fusion::reset(SubjectId subject) {
  if (pending_fit_ && pending_fit_->subject == subject) pending_fit_.reset();
  parts_.labeller->reset(subject);
}

Snapshot& Fusion::step(const FrameSet& frames) {
  const Expected& expected = expect(frames.exposed_at);
  const Matches& matches = parts_.matcher->match(frames, expected);
  const Markers& markers = parts_.triangulator->triangulate(frames, matches);
  if (parts_.drift) assessed_ = parts_.drift->update(frames, matches, markers);
  const TrackedMarkers& tracked = parts_.tracker->step(markers, expected, matches.bearing_only);
  snapshot_.labels = parts_.labeller->label(tracked, expected);
  learn_fit();
  label_bearings(frames, matches);
  snapshot_.poses = parts_.solver->solve(snapshot_.labels, frames.exposed_at, {bearings_.data(), bearings_.size()},
                                         parts_.labeller->ambiguous_observations());
  update_track_labels();
  retain_hidden_labels(matches);
  if (parts_.refiner && !pending_fit_) {
    pending_fit_ = parts_.refiner->step(snapshot_.labels, snapshot_.poses, frames.exposed_at);
  }

  snapshot_.number = frames.number;
  describe_views(frames);
  append_unlabelled(tracked);
  return snapshot_;
}

const Expected& Fusion::expect(Timestamp at) {
  expected_.at = at;
  expected_.markers.clear();
  parts_.tracker->predict(at, expected_);
  label_predictions();

  // A name whose track is gone is expected where the body says.
  body_predictions_.at = at;
  body_predictions_.markers.clear();
  parts_.solver->predict(at, body_predictions_);
  const std::size_t tracks = expected_.markers.size();
  for (const ExpectedMarker& predicted : body_predictions_.markers) {
    const auto has_label = [&](const ExpectedMarker& prediction) { return prediction.label == predicted.label; };
    auto* const end = expected_.markers.begin() + tracks;
    auto* const prediction = std::find_if(expected_.markers.begin(), end, has_label);
    if (prediction == end) {
      if (!expected_.markers.try_push_back(predicted)) break;
    } else if (find(retained_, prediction->track) != nullptr &&
               predicted.covariance_m2.trace() < prediction->covariance_m2.trace()) {
      prediction->position = predicted.position;
      prediction->covariance_m2 = predicted.covariance_m2;
    }
  }
  return expected_;
}

void Fusion::label_predictions() {
  for (ExpectedMarker& prediction : expected_.markers) {
    if (const TrackLabel* name = find(track_labels_, prediction.track)) {
      prediction.label = name->label;
    } else if (const RetainedLabel* retained = find(retained_, prediction.track)) {
      prediction.label = retained->label;
    }
  }
}

void Fusion::label_bearings(const FrameSet& frames, const Matches& matches) {
  bearings_.clear();
  for (const BearingOnlyObservation& bearing_only : matches.bearing_only) {
    const Label label = expected_.markers[bearing_only.expected].label;
    if (!label.names_something()) continue;
    static_cast<void>(bearings_.try_push_back({label, frames.views[bearing_only.sighting.view]->camera,
                                               bearing_only.eye, bearing_only.direction, bearing_only.sigma_rad}));
  }
}

// A name that left its track, for nobody sees it from two sides, goes on as the name of that track's rays, until a
// track bears it; over a moment in which its blob is another's, too.
void Fusion::retain_hidden_labels(const Matches& matches) {
  view_counts_.fill(0);
  for (const BearingOnlyObservation& bearing_only : matches.bearing_only) view_counts_[bearing_only.expected] = 1;
  for (const Match& match : matches.matches) {
    if (match.expected != Match::kNew) view_counts_[match.expected] = 2;
  }
  retained_before_ = retained_;
  retained_.clear();
  for (std::size_t i = 0; i < expected_.markers.size(); ++i) {
    const ExpectedMarker& one = expected_.markers[i];
    if (!one.label.names_something() || !one.track.names_something() || view_counts_[i] == 2) continue;
    const auto holds_label = [&](const TrackLabel& name) { return name.label == one.label || name.track == one.track; };
    if (std::any_of(track_labels_.begin(), track_labels_.end(), holds_label)) continue;
    const RetainedLabel* before = find(retained_before_, one.track);
    const Timestamp seen_at = before != nullptr && view_counts_[i] == 0 ? before->seen_at : expected_.at;
    if (expected_.at - seen_at < kLabelRetention)
      static_cast<void>(retained_.try_push_back({{one.track, one.label}, seen_at}));
  }
  sort_by_track(retained_);
}

void Fusion::learn_fit() {
  fit_ = parts_.labeller->take_fit();
  if (fit_) {
    if (parts_.refiner) parts_.refiner->recognised(*fit_);
    if (pending_fit_ && pending_fit_->subject == fit_->subject) pending_fit_.reset();
  } else if (pending_fit_) {
    fit_ = pending_fit_;
    pending_fit_.reset();
    parts_.labeller->refit(*fit_);
  } else {
    return;
  }
  fit_->description_version = ++snapshot_.description_version;
  parts_.solver->refit(*fit_);
}

void Fusion::update_track_labels() {
  track_labels_.clear();
  for (const SubjectLabels& subject : snapshot_.labels) {
    for (std::uint32_t i = 0; i < subject.markers.size(); ++i) {
      const TrackId track = subject.markers[i].track;
      if (track.names_something()) static_cast<void>(track_labels_.try_push_back({track, Label{subject.subject, i}}));
    }
  }
  sort_by_track(track_labels_);
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

void Fusion::append_unlabelled(const TrackedMarkers& tracked) {
  snapshot_.unlabelled.clear();
  for (const TrackedMarker& marker : tracked) {
    if (find(track_labels_, marker.id) != nullptr || marker.state != TrackState::Confirmed) continue;
    snapshot_.unlabelled.push_back({marker.id, marker.position, marker.residual_px, marker.cameras});
  }
}

}  // namespace mocap::fusion
