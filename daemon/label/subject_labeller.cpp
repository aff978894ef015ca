#include "label/subject_labeller.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/expects.h"

namespace mocap::label {
namespace {

// How far off its body's place a named marker is that contradicts, beside three times what markers commonly are.
constexpr double kOutlier_m = 0.02;
// A track that is not seen for longer leaves its name, which the body then knows better where to look for.
constexpr std::uint32_t kMostMissed = 2;
// A track that goes on for longer without being seen takes what is nearest then, and that may be another marker.
constexpr double kRemembersName_s = 0.15;
// What a track that leapt tells of whose it is, as a share of what one tells that did not: where a hand turns round
// within a set its tracks leap and stay on their markers; of twenty that leap one has taken another marker.
constexpr double kLeapt = 0.7;
// What the body's motion is wrong by: at least, and for each m that a marker moves from set to set.
constexpr double kSurprise_m = 0.007;
constexpr double kSurprisePerStep = 0.3;
// A track's step is foreseen from the last by this much, and a share of the step; limbs are thrown that hard.
constexpr double kJump_m = 0.02;
constexpr double kJumpPerStep = 0.1;
constexpr double kAcceleration_m_s2 = 100.0;
// A pose that names are judged by is held more firmly than one that is shown: what is common speaks against wrong ones.
constexpr pose::FollowSettings kFollow{
    .outlier_m = kOutlier_m, .max_iterations = 4, .told_rad = 0.15, .remembered_s = 0.0};
// How surely a marker that took part in the fit is where the fit puts it.
constexpr double kFitted_m = 0.008;

Eigen::Matrix3d ball(double sigma_m) { return sigma_m * sigma_m * Eigen::Matrix3d::Identity(); }

}  // namespace

SubjectLabeller::SubjectLabeller(const LabelSettings& settings, const Subject& subject, SubjectId id)
    : settings_(settings), id_(id), set_(subject.marker_set), ties_(set_), body_(set_, kFollow), limb_(set_, kFollow) {
  const std::size_t markers = set_.markers.size();
  const std::size_t bones = set_.skeleton.bones.size();
  MOCAP_EXPECTS(markers <= kMaxLabels);
  names_.resize(markers);
  places_.resize(markers);
  seen_.reserve(markers);
  believed_.resize(markers);
  trusted_.resize(markers);
  jumped_.resize(markers);
  before_.resize(markers);
  tried_.reserve(markers);
  strays_.reserve(kMaxMarkers);
  trouble_.resize(bones);
  rest_.resize(bones);
  in_limb_.resize(bones);
  misread_.resize(bones);
  loose_.resize(bones);
  near_.reserve(kMaxMarkers);
}

void SubjectLabeller::free(std::size_t marker, NamedTracks& tracks) {
  Name& name = names_[marker];
  if (name.index >= 0) tracks.named[static_cast<std::size_t>(name.index)] = false;
  if (name.held) {
    name.last = name.track;
    name.leapt = jumped_[marker];
    name.unbroken = true;
  }
  name.held = false;
  name.track = {};
  name.index = NamedTracks::kNone;
  name.doubt = 0;
  name.confidence = 0.0F;
  name.jumped = false;
}

void SubjectLabeller::give(std::size_t marker, int index, float confidence, NamedTracks& tracks) {
  tracks.named[static_cast<std::size_t>(index)] = true;
  Name& name = names_[marker];
  name.track = tracks[index].id;
  name.index = index;
  name.doubt = 0;
  name.confidence = confidence;
  name.held = name.last.names_something() && name.last == name.track && !name.leapt;
  name.last = {};
  name.jumped = false;
  name.seen_at = at_;
  name.at = tracks[index].position.v;
  name.velocity_m_s = tracks[index].velocity_m_s;
}

// How much it says for a name that the track bore it in the last set, or until it was lost or the name was taken back.
double SubjectLabeller::hint_of(std::size_t marker, int index, const NamedTracks& tracks) const {
  const Name& name = names_[marker];
  if (name.last.names_something() && name.last == tracks[index].id) return name.leapt ? kLeapt : 1.0;
  if (before_[marker] != index) return 0.0;
  if (jumped_[marker]) return name.held ? kLeapt : 0.0;
  return missed_by_neighbour(marker, tracks[index].id) ? 0.0 : 1.0;
}

bool SubjectLabeller::missed_by(std::size_t other, TrackId track) const {
  const Name& name = names_[other];
  return name.index < 0 && name.unbroken && name.last.names_something() && name.last == track;
}

bool SubjectLabeller::missed_by_neighbour(std::size_t marker, TrackId track) const {
  const std::span<const identify::Tie> ties = ties_.of(marker);
  return std::any_of(ties.begin(), ties.end(),
                     [&](const identify::Tie& tie) { return missed_by(static_cast<std::size_t>(tie.other), track); });
}

// Whether its track bore a neighbour's name before, and that name is missing since.
bool SubjectLabeller::contested(std::size_t marker) const {
  const Name& name = names_[marker];
  return name.index >= 0 && !name.held && missed_by_neighbour(marker, name.track);
}

// A name that was held for long is not taken for somebody else's any more.
void SubjectLabeller::hold(std::size_t marker) {
  if (names_[marker].held) return;
  names_[marker].held = true;
  for (Name& other : names_) {
    if (other.index < 0 && other.last == names_[marker].track) other.last = {};
  }
}

bool SubjectLabeller::seen(std::size_t marker, const NamedTracks& tracks) const {
  const int index = names_[marker].index;
  return index >= 0 && tracks[index].state != TrackState::Coasting;
}

// Whether the track goes on as it went. It may have taken another marker where it does not.
void SubjectLabeller::watch(Name& name, const TrackedMarker& track, Timestamp at) const {
  name.jumped = false;
  if (track.state == TrackState::Coasting) return;
  const double step_s = to_s(at - name.seen_at);
  const Eigen::Vector3d way = step_s * name.velocity_m_s;
  const double most_m = kJump_m + kJumpPerStep * way.norm() + 0.5 * kAcceleration_m_s2 * step_s * step_s;
  name.jumped = !((track.position.v - name.at - way).norm() < most_m);
  name.seen_at = at;
  name.at = track.position.v;
  name.velocity_m_s = track.velocity_m_s;
}

// The track that a name was taken from says whose it is as long as it goes on being seen.
void SubjectLabeller::watch_last(Name& name, const NamedTracks& tracks, Timestamp at) const {
  if (!name.last.names_something()) return;
  const int index = tracks.find(name.last);
  if (index < 0 || !tracks[index].position.v.allFinite() || to_s(at - name.seen_at) >= kRemembersName_s) {
    name.last = {};
    return;
  }
  if (tracks[index].missed_sets > kMostMissed) name.unbroken = false;
  if (!name.unbroken) return;
  watch(name, tracks[index], at);
  name.leapt = name.leapt || name.jumped;
  name.jumped = false;
}

void SubjectLabeller::keep(NamedTracks& tracks, Timestamp at) {
  for (std::size_t m = 0; m < names_.size(); ++m) {
    Name& name = names_[m];
    jumped_[m] = false;  // what is freed here was not seen
    watch_last(name, tracks, at);
    name.index = name.track.names_something() ? tracks.find(name.track) : NamedTracks::kNone;
    const TrackedMarker* track = name.index < 0 ? nullptr : &tracks[name.index];
    if (track == nullptr || !track->position.v.allFinite() || track->missed_sets > kMostMissed) {
      const TrackId lost = std::exchange(name.track, {});
      free(m, tracks);
      if (lost.names_something()) name.unbroken = name.leapt = false;
      if (track != nullptr) name.last = lost;
    } else {
      tracks.named[static_cast<std::size_t>(name.index)] = true;
      watch(name, *track, at);
    }
  }
}

double SubjectLabeller::sigma_of(int index, const NamedTracks& tracks) {
  const double noise = std::clamp(tracks[index].covariance_m2.trace() / 3.0, 0.0, 1.0);
  return std::sqrt(kMarkerSigma_m * kMarkerSigma_m + (std::isfinite(noise) ? noise : 1.0));
}

kinematics::Observation SubjectLabeller::observe(std::size_t marker, const NamedTracks& tracks) const {
  const int index = names_[marker].index;
  return {static_cast<int>(marker), tracks[index].position.v, sigma_of(index, tracks)};
}

// Believes the names that are where the body's motion leads to; where that is few, the motion is wrong, not they.
void SubjectLabeller::trust(const NamedTracks& tracks, Timestamp at) {
  seen_.clear();
  const double step_s = to_s(at - body_.learnt_at());
  std::size_t named = 0;
  for (std::size_t m = 0; m < names_.size(); ++m) {
    believed_[m] = false;
    if (!seen(m, tracks)) continue;
    ++named;
    const kinematics::Observation one = observe(m, tracks);
    const double surprise = names_[m].jumped ? 0.0 : kSurprisePerStep * body_.speed_of(m) * step_s;
    const double sigma = kSurprise_m + surprise + one.sigma_m;
    believed_[m] = (one.position - body_.told(m)).norm() < 3.0 * sigma;
    if (believed_[m]) seen_.push_back(one);
  }
  if (2 * seen_.size() >= named) return;
  seen_.clear();
  for (std::size_t m = 0; m < names_.size(); ++m) {
    believed_[m] = seen(m, tracks);
    if (believed_[m]) seen_.push_back(observe(m, tracks));
  }
}

void SubjectLabeller::expect(const NamedTracks& tracks, Timestamp at) {
  at_ = at;
  body_.predict(at);
  trust(tracks, at);
  for (std::size_t m = 0; m < names_.size(); ++m) {
    before_[m] = names_[m].index;
    jumped_[m] = names_[m].jumped;
  }
}

std::optional<SubjectLabeller::Stand> SubjectLabeller::place_of(std::size_t marker, const NamedTracks& tracks) const {
  if (!believed_[marker]) return std::nullopt;
  return Stand{tracks[before_[marker]].position.v, body_.told(marker)};
}

void SubjectLabeller::doubt(std::size_t marker) {
  believed_[marker] = false;
  jumped_[marker] = true;
  names_[marker].held = false;
}

void SubjectLabeller::fit(NamedTracks& tracks) {
  std::erase_if(seen_, [&](const kinematics::Observation& one) { return !believed_[static_cast<std::size_t>(one.marker)]; });
  (void)body_.fit(seen_);
  for (std::size_t m = 0; m < names_.size(); ++m) {
    if (believed_[m]) tracks.sure[static_cast<std::size_t>(before_[m])] = true;
  }
}

// Where the body says that each marker is, and how surely.
void SubjectLabeller::place() {
  const bool told = body_.weigh(seen_, at_);
  for (std::size_t m = 0; m < places_.size(); ++m) {
    Place& place = places_[m];
    place.at = body_.told(m);
    place.known = told && place.at.allFinite();
    place.covariance_m2 = ball(kFitted_m);
    if (believed_[m] || !place.known) continue;
    place.covariance_m2 += body_.told_covariance(m);
    place.known = place.covariance_m2.allFinite();
  }
}

void SubjectLabeller::settle(NamedTracks& tracks) {
  contradict(tracks);
  reread(tracks);
  body_.learn(seen_);
}

// Many names are missing while nameless tracks stand where they could be: it is another body, or another pose.
bool SubjectLabeller::followed_wrongly() const {
  const auto troubled = static_cast<std::size_t>(std::accumulate(trouble_.begin(), trouble_.end(), 0));
  return troubled >= 3 && 4 * troubled >= names_.size() && strays_.size() >= troubled;
}

void SubjectLabeller::judge(NamedTracks& tracks, Timestamp at) {
  std::size_t count = 0;
  for (std::size_t m = 0; m < names_.size(); ++m) count += seen(m, tracks) ? 1 : 0;
  if (4 * count >= names_.size() && count >= 3) enough_at_ = at;
  if (!followed_wrongly()) calm_at_ = at;
  if (at - enough_at_ <= settings_.lost_after && at - calm_at_ <= settings_.lost_after) return;
  for (std::size_t m = 0; m < names_.size(); ++m) free(m, tracks);
  limb_.stop();
  phase_ = SubjectPhase::Lost;
}

void SubjectLabeller::forget() {
  for (Name& name : names_) name = {};
  limb_.stop();
  phase_ = SubjectPhase::Searching;
}

bool SubjectLabeller::recognise(const Recognised& found, NamedTracks& tracks, Timestamp at) {
  at_ = at;
  for (std::size_t m = 0; m < names_.size(); ++m) {
    const TrackId id = found.track_of_marker[m];
    const int index = id.names_something() ? tracks.find(id) : NamedTracks::kNone;
    names_[m] = {};
    if (index >= 0 && !tracks.named[static_cast<std::size_t>(index)]) give(m, index, kFreshConfidence, tracks);
  }
  if (found.fitted_now) learn(found);
  seen_.clear();
  for (std::size_t m = 0; m < names_.size(); ++m) {
    believed_[m] = names_[m].index >= 0;
    if (believed_[m]) seen_.push_back(observe(m, tracks));
  }
  if (!body_.start(seen_, at)) {
    for (std::size_t m = 0; m < names_.size(); ++m) free(m, tracks);
    return false;
  }
  phase_ = SubjectPhase::Tracking;
  enough_at_ = calm_at_ = at;
  return true;
}

void SubjectLabeller::learn(const Recognised& found) {
  for (std::size_t b = 0; b < set_.skeleton.bones.size(); ++b) {
    set_.skeleton.bones[b].rest_offset_m = found.rest_offsets_m[b];
  }
  for (std::size_t m = 0; m < names_.size(); ++m) set_.markers[m].offset_m = found.marker_offsets_m[m];
  ties_.refit(set_);
  body_.refit(found.rest_offsets_m, found.marker_offsets_m);
  body_.forget_joints();
  fit_.emplace();
  fit_->subject = id_;
  fit_->rest_offsets_m = found.rest_offsets_m;
  fit_->marker_offsets_m = found.marker_offsets_m;
  fit_->residual_m = found.rms_m;
}

void SubjectLabeller::show(const NamedTracks& tracks, SubjectLabels& into) const {
  into.subject = id_;
  into.phase = phase_;
  into.markers.clear();
  for (std::size_t m = 0; m < names_.size(); ++m) {
    LabelledMarker& label = into.markers.push_back({});
    const Name& name = names_[m];
    if (name.index < 0) continue;
    const TrackedMarker& track = (*tracks.tracked)[static_cast<std::size_t>(name.index)];
    label.state = track.state == TrackState::Coasting || !believed_[m] ? LabelState::Filled : LabelState::Measured;
    label.position = track.position;
    label.covariance_m2 = track.covariance_m2;
    label.residual_px = track.residual_px;
    label.cameras = track.cameras;
    label.confidence = name.confidence;
    label.track = track.id;
  }
}

void SubjectLabeller::refit(const SubjectFit& fit) {
  MOCAP_EXPECTS(fit.rest_offsets_m.size() == set_.skeleton.bones.size() &&
                fit.marker_offsets_m.size() == set_.markers.size());
  for (std::size_t b = 0; b < set_.skeleton.bones.size(); ++b) {
    set_.skeleton.bones[b].rest_offset_m = fit.rest_offsets_m[b];
  }
  for (std::size_t m = 0; m < set_.markers.size(); ++m) set_.markers[m].offset_m = fit.marker_offsets_m[m];
  limb_.stop();
  ties_.refit(set_);
  body_.refit(fit.rest_offsets_m, fit.marker_offsets_m);
}

std::optional<SubjectFit> SubjectLabeller::take_fit() {
  std::optional<SubjectFit> fit = fit_;
  fit_.reset();
  return fit;
}

}  // namespace mocap::label
