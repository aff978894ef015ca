#include "fusion/fusion.h"

#include <algorithm>
#include <tuple>

namespace mocap::fusion {
namespace {

// A hidden marker's track that no camera has seen for so long may see another next.
constexpr Duration kRemembers = std::chrono::milliseconds(150);

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
  refined_ = fit;
}

void Fusion::reset(SubjectId subject) {
  if (refined_ && refined_->subject == subject) refined_.reset();
  parts_.labeller->reset(subject);
}

Snapshot& Fusion::step(const FrameSet& frames) {
  const Expected& expected = expect(frames.exposed_at);
  const Matches& matches = parts_.matcher->match(frames, expected);
  const Markers& markers = parts_.triangulator->triangulate(frames, matches);
  if (parts_.drift) assessed_ = parts_.drift->look(frames, matches, markers);
  const TrackedMarkers& tracked = parts_.tracker->step(markers, expected, matches.lone);
  snapshot_.labels = parts_.labeller->label(tracked, expected);
  learn_fit();
  name_the_rays(frames, matches);
  snapshot_.poses = parts_.solver->solve(snapshot_.labels, frames.exposed_at, {rays_.data(), rays_.size()},
                                         parts_.labeller->surmised());
  learn_names();
  keep_names_of_hidden(matches);
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
    auto* const end = expected_.markers.begin() + tracks;
    auto* const known = std::find_if(expected_.markers.begin(), end, borne);
    if (known == end) {
      if (!expected_.markers.try_push_back(told)) break;
    } else if (find(kept_, known->track) != nullptr && told.covariance_m2.trace() < known->covariance_m2.trace()) {
      known->position = told.position;
      known->covariance_m2 = told.covariance_m2;
    }
  }
  return expected_;
}

void Fusion::name_the_tracks() {
  for (ExpectedMarker& known : expected_.markers) {
    if (const BornBy* name = find(names_, known.track)) {
      known.label = name->label;
    } else if (const KeptName* kept = find(kept_, known.track)) {
      known.label = kept->label;
    }
  }
}

void Fusion::name_the_rays(const FrameSet& frames, const Matches& matches) {
  rays_.clear();
  for (const LoneSighting& lone : matches.lone) {
    const Label label = expected_.markers[lone.expected].label;
    if (!label.names_something()) continue;
    static_cast<void>(rays_.try_push_back(
        {label, frames.views[lone.sighting.view]->camera, lone.eye, lone.direction, lone.sigma_rad}));
  }
}

// A name that left its track, for nobody sees it from two sides, goes on as the name of that track's rays, until a
// track bears it; over a moment in which its blob is another's, too.
void Fusion::keep_names_of_hidden(const Matches& matches) {
  views_of_.fill(0);
  for (const LoneSighting& lone : matches.lone) views_of_[lone.expected] = 1;
  for (const Match& match : matches.matches) {
    if (match.expected != Match::kNew) views_of_[match.expected] = 2;
  }
  kept_before_ = kept_;
  kept_.clear();
  for (std::size_t i = 0; i < expected_.markers.size(); ++i) {
    const ExpectedMarker& one = expected_.markers[i];
    if (!one.label.names_something() || !one.track.names_something() || views_of_[i] == 2) continue;
    const auto bears = [&](const BornBy& name) { return name.label == one.label || name.track == one.track; };
    if (std::any_of(names_.begin(), names_.end(), bears)) continue;
    const KeptName* before = find(kept_before_, one.track);
    const Timestamp seen_at = before != nullptr && views_of_[i] == 0 ? before->seen_at : expected_.at;
    if (expected_.at - seen_at < kRemembers) static_cast<void>(kept_.try_push_back({{one.track, one.label}, seen_at}));
  }
  sort_by_track(kept_);
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
  sort_by_track(names_);
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
    if (find(names_, marker.id) != nullptr || marker.state != TrackState::Confirmed) continue;
    snapshot_.unlabelled.push_back({marker.id, marker.position, marker.residual_px, marker.cameras});
  }
}

}  // namespace mocap::fusion
