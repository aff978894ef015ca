#include "label/subject_labeller.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/expects.h"

namespace mocap::label {
namespace {

// Measured labels that determine the pose of a body at least in part; with fewer, it rotates freely (decision 0020).
constexpr std::size_t kMinPoseLabels = 3;

// Residual from which on a marker is an outlier of the robust pose fit. Chosen by hand; not yet measured.
constexpr double kOutlier_m = 0.02;
// A label leaves a track that was not detected for more sets: by then the body predicts the marker better than the
// coasting track does. Chosen by hand; not yet measured.
constexpr std::uint32_t kMaxMissedSets = 2;
// Time after which a former track is no evidence for a label: a track that coasts for longer may continue on another
// marker (decision 0004). Chosen by hand; not yet measured.
constexpr double kLabelMemory_s = 0.15;
// Weight of a discontinuous track as evidence for its label; a continuous track has 1. One discontinuous track in
// twenty was on another marker (decision 0006).
constexpr double kDiscontinuousContinuity = 0.7;
// Standard deviation of the predicted position of a marker: a constant and a share of the step from set to set. Chosen
// by hand; not yet measured.
constexpr double kPredictionSigma_m = 0.007;
constexpr double kPredictionSigmaPerStep = 0.3;
// Gate on the deviation of a track from constant velocity: a constant, a share of the step, and the way of the largest
// acceleration of a limb. Chosen by hand; not yet measured.
constexpr double kContinuityGate_m = 0.02;
constexpr double kContinuityGatePerStep = 0.1;
constexpr double kAcceleration_m_s2 = 100.0;
// The pose by which labels are judged has firmer priors than the published pose, and no memory of earlier observations
// of a joint: with weak priors the pose follows wrong labels and then confirms them (decision 0002).
constexpr pose::SkeletonTrackerSettings kFollow{
    .outlier_m = kOutlier_m, .max_iterations = 4, .observability_prior_rad = 0.15, .rest_prior_time_constant_s = 0.0};

}  // namespace

SubjectLabeller::SubjectLabeller(const LabelSettings& settings, const Subject& subject, SubjectId id)
    : settings_(settings),
      id_(id),
      set_(subject.marker_set),
      constraints_(set_),
      body_(set_, kFollow),
      limb_(set_, kFollow) {
  const std::size_t markers = set_.markers.size();
  const std::size_t bones = set_.skeleton.bones.size();
  MOCAP_EXPECTS(markers <= kMaxLabels);
  memories_.resize(markers);
  places_.resize(markers);
  observations_.reserve(markers);
  accepted_.resize(markers);
  motion_consistent_.resize(markers);
  discontinuous_.resize(markers);
  previous_tracks_.resize(markers);
  trial_observations_.reserve(markers);
  unassigned_tracks_.reserve(kMaxMarkers);
  unexplained_.resize(bones);
  cooldown_.resize(bones);
  in_limb_.resize(bones);
  unreliable_.resize(bones);
  unconstrained_.resize(bones);
  nearby_tracks_.reserve(kMaxMarkers);
}

void SubjectLabeller::release(std::size_t marker, LabelledTracks& tracks) {
  LabelMemory& memory = memories_[marker];
  if (memory.index >= 0) tracks.labelled[static_cast<std::size_t>(memory.index)] = false;
  if (memory.established) {
    memory.last_track = memory.track;
    memory.was_discontinuous = discontinuous_[marker];
    memory.is_continuous = true;
  }
  memory.established = false;
  memory.track = {};
  memory.index = LabelledTracks::kNone;
  memory.reject_count = 0;
  memory.confidence = 0.0F;
  memory.discontinuous = false;
}

void SubjectLabeller::assign_track(std::size_t marker, int index, float confidence, LabelledTracks& tracks) {
  tracks.labelled[static_cast<std::size_t>(index)] = true;
  LabelMemory& memory = memories_[marker];
  memory.track = tracks[index].id;
  memory.index = index;
  memory.reject_count = 0;
  memory.confidence = confidence;
  memory.established =
      memory.last_track.names_something() && memory.last_track == memory.track && !memory.was_discontinuous;
  memory.last_track = {};
  memory.discontinuous = false;
  memory.seen_at = at_;
  memory.at = tracks[index].position.v;
  memory.velocity_m_s = tracks[index].velocity_m_s;
}

// Evidence, 0 to 1, that the track is this marker because it had the label: in the last set, or until the label was
// released. Zero if the track had the label of a neighbour that is missing now.
double SubjectLabeller::continuity_of(std::size_t marker, int index, const LabelledTracks& tracks) const {
  const LabelMemory& memory = memories_[marker];
  if (memory.last_track.names_something() && memory.last_track == tracks[index].id)
    return memory.was_discontinuous ? kDiscontinuousContinuity : 1.0;
  if (previous_tracks_[marker] != index) return 0.0;
  if (discontinuous_[marker]) return memory.established ? kDiscontinuousContinuity : 0.0;
  return is_last_track_of_neighbour(marker, tracks[index].id) ? 0.0 : 1.0;
}

bool SubjectLabeller::is_last_track_of(std::size_t other, TrackId track) const {
  const LabelMemory& memory = memories_[other];
  return memory.index < 0 && memory.is_continuous && memory.last_track.names_something() && memory.last_track == track;
}

bool SubjectLabeller::is_last_track_of_neighbour(std::size_t marker, TrackId track) const {
  const std::span<const identify::InterMarkerDistance> constraints = constraints_.of(marker);
  return std::any_of(constraints.begin(), constraints.end(), [&](const identify::InterMarkerDistance& constraint) {
    return is_last_track_of(static_cast<std::size_t>(constraint.other), track);
  });
}

// Whether the track of a new label had the label of a neighbouring marker before, and that label is missing now.
bool SubjectLabeller::is_contested(std::size_t marker) const {
  const LabelMemory& memory = memories_[marker];
  return memory.index >= 0 && !memory.established && is_last_track_of_neighbour(marker, memory.track);
}

// Marks a label as established. Missing labels drop their hint that they had this track.
void SubjectLabeller::establish(std::size_t marker) {
  if (memories_[marker].established) return;
  memories_[marker].established = true;
  for (LabelMemory& other : memories_) {
    if (other.index < 0 && other.last_track == memories_[marker].track) other.last_track = {};
  }
}

bool SubjectLabeller::is_measured(std::size_t marker, const LabelledTracks& tracks) const {
  const int index = memories_[marker].index;
  return index >= 0 && tracks[index].state != TrackState::Coasting;
}

// Compares the track with its own constant-velocity prediction. A discontinuous track may be on another marker now.
void SubjectLabeller::check_continuity(LabelMemory& memory, const TrackedMarker& track, Timestamp at) const {
  memory.discontinuous = false;
  if (track.state == TrackState::Coasting) return;
  const double step_s = to_s(at - memory.seen_at);
  const Eigen::Vector3d way = step_s * memory.velocity_m_s;
  const double most_m =
      kContinuityGate_m + kContinuityGatePerStep * way.norm() + 0.5 * kAcceleration_m_s2 * step_s * step_s;
  memory.discontinuous = !((track.position.v - memory.at - way).norm() < most_m);
  memory.seen_at = at;
  memory.at = track.position.v;
  memory.velocity_m_s = track.velocity_m_s;
}

// Follows the former track of a label: the hint ends with the track, and is weaker after a gap or a discontinuity.
void SubjectLabeller::check_last_track(LabelMemory& memory, const LabelledTracks& tracks, Timestamp at) const {
  if (!memory.last_track.names_something()) return;
  const int index = tracks.find(memory.last_track);
  if (index < 0 || !tracks[index].position.v.allFinite() || to_s(at - memory.seen_at) >= kLabelMemory_s) {
    memory.last_track = {};
    return;
  }
  if (tracks[index].missed_sets > kMaxMissedSets) memory.is_continuous = false;
  if (!memory.is_continuous) return;
  check_continuity(memory, tracks[index], at);
  memory.was_discontinuous = memory.was_discontinuous || memory.discontinuous;
  memory.discontinuous = false;
}

void SubjectLabeller::match_tracks(LabelledTracks& tracks, Timestamp at) {
  for (std::size_t m = 0; m < memories_.size(); ++m) {
    LabelMemory& memory = memories_[m];
    discontinuous_[m] = false;  // a track that is released here was not detected, so it has no discontinuity
    check_last_track(memory, tracks, at);
    memory.index = memory.track.names_something() ? tracks.find(memory.track) : LabelledTracks::kNone;
    const TrackedMarker* track = memory.index < 0 ? nullptr : &tracks[memory.index];
    if (track == nullptr || !track->position.v.allFinite() || track->missed_sets > kMaxMissedSets) {
      const TrackId lost = std::exchange(memory.track, {});
      release(m, tracks);
      if (lost.names_something()) memory.is_continuous = memory.was_discontinuous = false;
      if (track != nullptr) memory.last_track = lost;
    } else {
      tracks.labelled[static_cast<std::size_t>(memory.index)] = true;
      check_continuity(memory, *track, at);
    }
  }
}

double SubjectLabeller::sigma_of(int index, const LabelledTracks& tracks) {
  const double noise = std::clamp(tracks[index].covariance_m2.trace() / 3.0, 0.0, 1.0);
  return std::sqrt(kMarkerSigma_m * kMarkerSigma_m + (std::isfinite(noise) ? noise : 1.0));
}

kinematics::Observation SubjectLabeller::observe(std::size_t marker, const LabelledTracks& tracks) const {
  const int index = memories_[marker].index;
  return {static_cast<int>(marker), tracks[index].position.v, sigma_of(index, tracks)};
}

// Accepts the labels whose tracks are within 3 sigma of the predicted position. If fewer than half are, the predicted
// motion is wrong rather than the labels, and all detected labels are accepted.
void SubjectLabeller::select_consistent(const LabelledTracks& tracks, Timestamp at) {
  observations_.clear();
  const double step_s = to_s(at - body_.committed_at());
  std::size_t labelled = 0;
  for (std::size_t m = 0; m < memories_.size(); ++m) {
    accepted_[m] = false;
    if (!is_measured(m, tracks)) continue;
    ++labelled;
    const kinematics::Observation one = observe(m, tracks);
    const double motion_error_m =
        memories_[m].discontinuous ? 0.0 : kPredictionSigmaPerStep * body_.speed_of(m) * step_s;
    const double sigma = kPredictionSigma_m + motion_error_m + one.sigma_m;
    accepted_[m] = (one.position - body_.predicted_position(m)).norm() < 3.0 * sigma;
    if (accepted_[m]) observations_.push_back(one);
  }
  if (2 * observations_.size() >= labelled) return;
  observations_.clear();
  for (std::size_t m = 0; m < memories_.size(); ++m) {
    accepted_[m] = is_measured(m, tracks);
    if (accepted_[m]) observations_.push_back(observe(m, tracks));
  }
}

void SubjectLabeller::predict(const LabelledTracks& tracks, Timestamp at) {
  at_ = at;
  body_.predict(at);
  select_consistent(tracks, at);
  for (std::size_t m = 0; m < memories_.size(); ++m) {
    previous_tracks_[m] = memories_[m].index;
    discontinuous_[m] = memories_[m].discontinuous;
  }
}

std::optional<SubjectLabeller::MarkerResidual> SubjectLabeller::marker_residual(std::size_t marker,
                                                                                const LabelledTracks& tracks) const {
  if (!accepted_[marker]) return std::nullopt;
  return MarkerResidual{tracks[previous_tracks_[marker]].position.v, body_.predicted_position(marker)};
}

void SubjectLabeller::distrust(std::size_t marker) {
  accepted_[marker] = false;
  discontinuous_[marker] = true;
  memories_[marker].established = false;
}

void SubjectLabeller::fit(LabelledTracks& tracks) {
  std::erase_if(observations_,
                [&](const kinematics::Observation& one) { return !accepted_[static_cast<std::size_t>(one.marker)]; });
  (void)body_.update(observations_);
  for (std::size_t m = 0; m < memories_.size(); ++m) {
    if (accepted_[m]) tracks.trusted[static_cast<std::size_t>(previous_tracks_[m])] = true;
  }
}

// Positions and covariances of all markers by the fitted pose. A marker without an accepted label has the covariance
// that the joints between it and the observed markers leave.
void SubjectLabeller::predict_places() {
  const bool has_pose = body_.compute_covariances(observations_, at_);
  for (std::size_t m = 0; m < places_.size(); ++m) {
    PredictedPlace& place = places_[m];
    place.at = body_.predicted_position(m);
    place.known = has_pose && place.at.allFinite();
    place.covariance_m2 = isotropic_covariance(kFittedMarkerSigma_m);
    if (accepted_[m] || !place.known) continue;
    place.covariance_m2 += body_.predicted_covariance(m);
    place.known = place.covariance_m2.allFinite();
  }
}

void SubjectLabeller::revise(LabelledTracks& tracks) {
  reject_contradicted(tracks);
  reassociate_limbs(tracks);
  body_.commit(observations_);
}

// Whether at least three labels, and a quarter of all, are missing while as many unassigned tracks are near: then the
// tracks are of another body, or of a pose that the tracker has lost.
bool SubjectLabeller::follows_wrong_tracks() const {
  const auto unexplained = static_cast<std::size_t>(std::accumulate(unexplained_.begin(), unexplained_.end(), 0));
  return unexplained >= 3 && 4 * unexplained >= memories_.size() && unassigned_tracks_.size() >= unexplained;
}

void SubjectLabeller::check_loss(LabelledTracks& tracks, Timestamp at) {
  std::size_t count = 0;
  for (std::size_t m = 0; m < memories_.size(); ++m) count += is_measured(m, tracks) ? 1 : 0;
  if (count >= kMinPoseLabels) determined_at_ = at;
  if (4 * count >= memories_.size() && count >= kMinPoseLabels) enough_at_ = at;
  if (!follows_wrong_tracks()) plausible_at_ = at;
  if (at - enough_at_ <= settings_.lost_after && at - plausible_at_ <= settings_.lost_after) return;
  for (std::size_t m = 0; m < memories_.size(); ++m) release(m, tracks);
  limb_.stop();
  phase_ = SubjectPhase::Lost;
}

bool SubjectLabeller::is_out_of_sight(Timestamp at, Duration step) const {
  return at - determined_at_ > std::max(from_s(kLabelMemory_s), 2 * step);
}

void SubjectLabeller::lose() {
  forget();
  phase_ = SubjectPhase::Lost;
}

void SubjectLabeller::forget() {
  for (LabelMemory& memory : memories_) memory = {};
  limb_.stop();
  phase_ = SubjectPhase::Searching;
}

void SubjectLabeller::adopt(SubjectLabeller& before) {
  const LabelSettings settings = settings_;
  const SubjectId id = id_;
  *this = std::move(before);
  settings_ = settings;
  id_ = id;
  if (fit_) fit_->subject = id;
}

bool SubjectLabeller::recognise(const RecognisedSubject& found, LabelledTracks& tracks, Timestamp at) {
  at_ = at;
  for (std::size_t m = 0; m < memories_.size(); ++m) {
    const TrackId id = found.track_of_marker[m];
    const int index = id.names_something() ? tracks.find(id) : LabelledTracks::kNone;
    memories_[m] = {};
    if (index >= 0 && !tracks.labelled[static_cast<std::size_t>(index)])
      assign_track(m, index, kNewLabelConfidence, tracks);
  }
  if (found.is_newly_fitted) learn(found);
  observations_.clear();
  for (std::size_t m = 0; m < memories_.size(); ++m) {
    accepted_[m] = memories_[m].index >= 0;
    if (accepted_[m]) observations_.push_back(observe(m, tracks));
  }
  if (!body_.start(observations_, at)) {
    for (std::size_t m = 0; m < memories_.size(); ++m) release(m, tracks);
    return false;
  }
  phase_ = SubjectPhase::Tracking;
  ++identifications_;
  determined_at_ = enough_at_ = plausible_at_ = at;
  return true;
}

void SubjectLabeller::learn(const RecognisedSubject& found) {
  set_offsets(found.rest_offsets_m, found.marker_offsets_m);
  body_.reset_joint_calibration();
  fit_.emplace();
  fit_->subject = id_;
  fit_->rest_offsets_m = found.rest_offsets_m;
  fit_->marker_offsets_m = found.marker_offsets_m;
  fit_->residual_m = found.rms_m;
  fit_->in_any_pose = found.in_any_pose;
  fit_->at_identification = true;
}

void SubjectLabeller::write_labels(const LabelledTracks& tracks, SubjectLabels& into) const {
  into.subject = id_;
  into.phase = phase_;
  into.identifications = identifications_;
  into.markers.clear();
  for (std::size_t m = 0; m < memories_.size(); ++m) {
    LabelledMarker& label = into.markers.push_back({});
    const LabelMemory& memory = memories_[m];
    if (memory.index < 0) continue;
    const TrackedMarker& track = (*tracks.tracked)[static_cast<std::size_t>(memory.index)];
    label.state = track.state == TrackState::Coasting || !accepted_[m] ? LabelState::Filled : LabelState::Measured;
    label.position = track.position;
    label.covariance_m2 = track.covariance_m2;
    label.residual_px = track.residual_px;
    label.cameras = track.cameras;
    label.seen_by = track.seen_by;
    label.confidence = memory.confidence;
    label.track = track.id;
  }
}

void SubjectLabeller::refit(const SubjectFit& fit) {
  MOCAP_EXPECTS(fit.rest_offsets_m.size() == set_.skeleton.bones.size() &&
                fit.marker_offsets_m.size() == set_.markers.size());
  limb_.stop();
  set_offsets(fit.rest_offsets_m, fit.marker_offsets_m);
}

void SubjectLabeller::set_offsets(std::span<const Eigen::Vector3d> rest_offsets_m,
                                  std::span<const Eigen::Vector3d> marker_offsets_m) {
  for (std::size_t b = 0; b < set_.skeleton.bones.size(); ++b) set_.skeleton.bones[b].rest_offset_m = rest_offsets_m[b];
  for (std::size_t m = 0; m < set_.markers.size(); ++m) set_.markers[m].offset_m = marker_offsets_m[m];
  constraints_.refit(set_);
  body_.refit(rest_offsets_m, marker_offsets_m);
}

std::optional<SubjectFit> SubjectLabeller::take_fit() { return std::exchange(fit_, std::nullopt); }

}  // namespace mocap::label
