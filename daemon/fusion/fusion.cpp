#include "fusion/fusion.h"

#include <algorithm>
#include <bitset>
#include <utility>

#include "base/expects.h"

namespace mocap::fusion {

Fusion::Fusion(FusionParts parts, std::uint32_t camera_count) : parts_(std::move(parts)), identities_(camera_count) {
  MOCAP_EXPECTS(parts_.matcher && parts_.triangulator && parts_.tracker && parts_.labeller && parts_.solver);
  snapshot_.expected_views = camera_count;
  snapshot_.description_version = 1;
  fits_.reserve(kMaxSubjects);
}

void Fusion::adopt(Fusion& before, const Handover& handover) {
  if (handover.matching) {
    parts_.matcher.swap(before.parts_.matcher);
    parts_.triangulator.swap(before.parts_.triangulator);
  }
  if (handover.drift) parts_.drift.swap(before.parts_.drift);
  parts_.tracker->adopt(*before.parts_.tracker, handover);
  parts_.labeller->adopt(*before.parts_.labeller, handover);
  parts_.solver->adopt(*before.parts_.solver, handover);
  identities_.adopt(before.identities_, handover);
  for (SubjectFit fit : before.fits_) {
    fit.subject = handover.now(fit.subject);
    if (!fit.subject.names_something()) continue;
    fits_.push_back(fit);
    if (!before.parts_.refiner) inform_refiner(fit);
  }
  if (parts_.refiner && before.parts_.refiner) parts_.refiner->adopt(*before.parts_.refiner, handover);
  for (SubjectFit fit : before.pending_fits_) {
    fit.subject = handover.now(fit.subject);
    if (!fit.subject.names_something()) continue;
    add_pending_fit(fit);
    if (!before.parts_.refiner) inform_refiner(fit);
  }
  snapshot_.description_version = before.snapshot_.description_version + 1;
}

void Fusion::archive(Archive& members) {
  members(identities_, assessed_, pending_fits_, fits_, snapshot_.description_version);
  members(*parts_.matcher, *parts_.triangulator, *parts_.tracker, *parts_.labeller, *parts_.solver);
  if (parts_.refiner) members(*parts_.refiner);
  if (parts_.drift) members(*parts_.drift);
  if (parts_.drift && assessed_.value >= identities_.camera_count()) members.fail();
}

void Fusion::refit(const SubjectFit& fit) {
  inform_refiner(fit);
  add_pending_fit(fit);
}

// Passes a fit that was not made in this set to the refiner: the subject may be in any pose.
void Fusion::inform_refiner(const SubjectFit& fit) {
  if (!parts_.refiner) return;
  SubjectFit in_any_pose = fit;
  in_any_pose.in_any_pose = true;
  parts_.refiner->recognised(in_any_pose);
}

void Fusion::add_pending_fit(const SubjectFit& fit) {
  drop_pending_fit(fit.subject);
  (void)pending_fits_.try_push_back(fit);  // has room for each subject
}

void Fusion::drop_pending_fit(SubjectId subject) {
  const auto dropped = std::ranges::remove(pending_fits_, subject, &SubjectFit::subject);
  while (pending_fits_.end() != dropped.begin()) pending_fits_.pop_back();
}

void Fusion::reset(SubjectId subject) {
  drop_pending_fit(subject);
  if (parts_.refiner) parts_.refiner->forget(subject);
  parts_.labeller->reset(subject);
}

Snapshot& Fusion::step(const FrameSet& frames) {
  const Timestamp at = frames.exposed_at;
  const Predictions& predicted = identities_.predict(frames, parts_.tracker->predict(at), parts_.solver->predict(at));
  const Matches& matches = parts_.matcher->match(frames, predicted);
  const Markers& markers = parts_.triangulator->triangulate(frames, matches);
  count_blobs(frames, matches, markers);
  const TrackedMarkers& tracked = parts_.tracker->step(markers, predicted, matches.bearing_only, matches.candidates);
  const Labelling& labelled = parts_.labeller->label(tracked, predicted);
  use_fit(labelled.fit);
  report_search(labelled.search, frames, matches, markers);
  const LabelledBearings& bearings = label_bearings(frames, matches, predicted);
  const SolvedSubjects& solved = parts_.solver->solve(labelled.labels, at, bearings, labelled.ambiguous_observations);
  identities_.update(frames, matches, labelled.labels);
  refine(solved, at);
  if (parts_.drift) assessed_ = parts_.drift->update(frames, matches, markers);
  return describe(frames, tracked, solved);
}

// Completes the labeller's report with the blobs of each view and their share in markers.
void Fusion::report_search(const SearchReport* search, const FrameSet& frames, const Matches& matches,
                           const Markers& markers) {
  search_.reset();
  if (search == nullptr) return;
  search_ = *search;
  search_->views.clear();
  for (const BlobFrame* view : frames.views) {
    search_->views.push_back({view->camera, static_cast<std::uint32_t>(view->blobs.size()), 0});
  }
  for (const Marker& marker : markers) {
    for (const BlobRef& sighting : matches.matches[marker.match].sightings) ++search_->views[sighting.view].in_markers;
  }
}

// Passes a new fit to the parts that use it: the fit with which a subject was identified in this step, or else the
// first pending one.
void Fusion::use_fit(const std::optional<SubjectFit>& identified) {
  fit_ = identified;
  if (fit_) {
    if (parts_.refiner) parts_.refiner->recognised(*fit_);
    drop_pending_fit(fit_->subject);
  } else if (!pending_fits_.empty()) {
    fit_ = pending_fits_.front();
    drop_pending_fit(fit_->subject);
    parts_.labeller->refit(*fit_);
  } else {
    return;
  }
  fit_->description_version = ++snapshot_.description_version;
  parts_.solver->refit(*fit_);
  remember_fit();
}

void Fusion::remember_fit() {
  const auto known = std::ranges::find(fits_, fit_->subject, &SubjectFit::subject);
  if (known != fits_.end()) {
    const bool maybe_other_person = known->at_identification;  // also after later fits of that body
    *known = *fit_;
    known->at_identification |= maybe_other_person;
  } else if (fits_.size() < fits_.capacity()) {
    fits_.push_back(*fit_);
  }
}

// The bearing-only observations of markers that have a label.
const LabelledBearings& Fusion::label_bearings(const FrameSet& frames, const Matches& matches,
                                               const Predictions& predicted) {
  bearings_.clear();
  for (const BearingOnlyObservation& bearing_only : matches.bearing_only) {
    const Label label = predicted.markers[bearing_only.prediction].label;
    if (!label.names_something()) continue;
    bearings_.push_back({label, frames.views[bearing_only.sighting.view]->camera, bearing_only.eye,
                         bearing_only.direction, bearing_only.sigma_rad});
  }
  return bearings_;
}

void Fusion::refine(const SolvedSubjects& solved, Timestamp at) {
  if (!parts_.refiner || !pending_fits_.empty()) return;
  if (const std::optional<SubjectFit> fit = parts_.refiner->step(solved.labels, solved.poses, at))
    add_pending_fit(*fit);
}

void Fusion::count_blobs(const FrameSet& frames, const Matches& matches, const Markers& markers) {
  blob_use_.fill({});
  std::array<std::bitset<kMaxBlobs>, kMaxCameras> in_markers;  // by view; markers may share a merged blob
  for (const Marker& marker : markers) {
    for (const BlobRef& ref : matches.matches[marker.match].sightings) in_markers[ref.view].set(ref.blob);
  }
  for (std::size_t v = 0; v < frames.views.size(); ++v)
    blob_use_[frames.views[v]->camera.value] = {frames.views[v]->blobs.size(), in_markers[v].count()};
}

Snapshot& Fusion::describe(const FrameSet& frames, const TrackedMarkers& tracked, const SolvedSubjects& solved) {
  snapshot_.number = frames.number;
  snapshot_.delivering_cameras = frames.expected_views;
  snapshot_.labels = solved.labels;
  snapshot_.poses = solved.poses;
  describe_views(frames);
  describe_unlabelled(tracked);
  return snapshot_;
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

void Fusion::describe_unlabelled(const TrackedMarkers& tracked) {
  snapshot_.unlabelled.clear();
  for (const TrackedMarker& marker : tracked) {
    if (identities_.has_label(marker.id) || marker.state != TrackState::Confirmed) continue;
    snapshot_.unlabelled.push_back(
        {marker.id, marker.position, marker.residual_px, marker.cameras, marker.seen_by, marker.covariance_m2});
  }
}

}  // namespace mocap::fusion
