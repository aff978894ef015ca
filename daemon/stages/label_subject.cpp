#include "stages/label_subject.h"

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

#include "base/expects.h"

namespace mocap::stages {
namespace {

// A contradiction must last for as many sets before a name is taken back; a gross one counts as all of them.
constexpr int kMostDoubt = 3;
// How far off its body's place a named marker is that contradicts, beside three times what markers commonly are.
constexpr double kOutlier_m = 0.02;
constexpr double kOff_m = 0.012;
// More points than any T-pose with its ghosts has; bounds the cost of a search.
constexpr std::size_t kMostPoints = 160;
constexpr std::size_t kMostPairs = 8192;
// A track that is not seen for longer leaves its name, which the body then knows better where to look for.
constexpr std::uint32_t kMostMissed = 2;
// What the body's motion is wrong by: at least, and for each m that a marker moves from set to set.
constexpr double kSurprise_m = 0.007;
constexpr double kSurprisePerStep = 0.3;
constexpr double kGateSigmas = 4.0;
// How surely a marker that took part in the fit is where the fit puts it.
constexpr double kFitted_m = 0.008;
// What a turn bends out of a straight line is a square's half over the limb's length.
constexpr double kLimb_m = 0.35;
// In squared sigmas: what a name's own track is preferred by, and what leaving a name alone costs.
constexpr double kOwnBonus = 6.0;
constexpr double kAlone = 30.0;

double slack_of(const body::Tie& tie, double base_m) { return base_m + 0.05 * tie.most_m; }

Eigen::Matrix3d ball(double sigma_m) { return sigma_m * sigma_m * Eigen::Matrix3d::Identity(); }

}  // namespace

void NamedTracks::take(const TrackedMarkers& from) {
  tracked = &from;
  by_id.clear();
  for (std::size_t i = 0; i < from.size(); ++i) by_id.emplace_back(from[i].id, static_cast<int>(i));
  std::sort(by_id.begin(), by_id.end());
  named.assign(from.size(), false);
}

int NamedTracks::find(TrackId id) const {
  const auto found = std::lower_bound(by_id.begin(), by_id.end(), std::pair{id, 0});
  return found != by_id.end() && found->first == id ? found->second : kNone;
}

SubjectLabeller::SubjectLabeller(const LabelSettings& settings, const Subject& subject, SubjectId id)
    : settings_(settings),
      id_(id),
      set_(subject.marker_set),
      ties_(set_),
      tpose_(set_, {.least_share = settings.least_share, .most_rms_m = settings.most_rms_m}, kMostPoints),
      shape_(set_, settings.rigid_tolerance_m),
      body_(set_, {.outlier_m = kOutlier_m, .max_iterations = 4}),
      assigner_(set_.markers.size(), kMaxMarkers, kMostPairs) {
  MOCAP_EXPECTS(set_.markers.size() <= kMaxLabels);
  names_.resize(set_.markers.size());
  places_.resize(names_.size());
  seen_.reserve(names_.size());
  believed_.resize(names_.size());
  pairs_.reserve(kMostPairs);
  before_.resize(names_.size());
  readings_.reserve(kMostReadings);
  tried_.reserve(names_.size());
}

void SubjectLabeller::free(std::size_t marker, NamedTracks& tracks) {
  Name& name = names_[marker];
  if (name.index >= 0) tracks.named[static_cast<std::size_t>(name.index)] = false;
  name = {};
}

void SubjectLabeller::give(std::size_t marker, int index, float confidence, NamedTracks& tracks) {
  const auto i = static_cast<std::size_t>(index);
  tracks.named[i] = true;
  names_[marker] = {(*tracks.tracked)[i].id, index, 0, confidence};
}

bool SubjectLabeller::seen(std::size_t marker, const NamedTracks& tracks) const {
  const int index = names_[marker].index;
  return index >= 0 && (*tracks.tracked)[static_cast<std::size_t>(index)].state != TrackState::Coasting;
}

void SubjectLabeller::keep(NamedTracks& tracks) {
  for (std::size_t m = 0; m < names_.size(); ++m) {
    Name& name = names_[m];
    name.index = name.track.names_something() ? tracks.find(name.track) : NamedTracks::kNone;
    const TrackedMarker* track = name.index < 0 ? nullptr : &(*tracks.tracked)[static_cast<std::size_t>(name.index)];
    if (track == nullptr || !track->position.v.allFinite() || track->missed_sets > kMostMissed) {
      name = {};
    } else {
      tracks.named[static_cast<std::size_t>(name.index)] = true;
    }
  }
}

// Whether the distances to the neighbours that are seen allow a marker to be there.
bool SubjectLabeller::tied(std::size_t marker, const Eigen::Vector3d& at, const NamedTracks& tracks) const {
  int kept = 0;
  int broken = 0;
  for (const body::Tie& tie : ties_.of(marker)) {
    const auto other = static_cast<std::size_t>(tie.other);
    if (!believed_[other] || !seen(other, tracks)) continue;
    const auto index = static_cast<std::size_t>(names_[other].index);
    const double apart = ((*tracks.tracked)[index].position.v - at).norm();
    const double over = std::max(tie.least_m - apart, apart - tie.most_m);
    (over > slack_of(tie, settings_.tie_slack_m) ? broken : kept) += 1;
  }
  return broken <= kept / 3;
}

body::Observation SubjectLabeller::observe(std::size_t marker, const NamedTracks& tracks) const {
  const TrackedMarker& track = (*tracks.tracked)[static_cast<std::size_t>(names_[marker].index)];
  const double noise = std::clamp(track.covariance_m2.trace() / 3.0, 0.0, 1.0);
  return {static_cast<int>(marker), track.position.v,
          std::sqrt(kMarkerSigma_m * kMarkerSigma_m + (std::isfinite(noise) ? noise : 1.0))};
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
    const body::Observation one = observe(m, tracks);
    const double sigma = kSurprise_m + kSurprisePerStep * body_.speed_of(m) * step_s + one.sigma_m;
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

// Where the body says that each marker is, and how surely.
void SubjectLabeller::place(Timestamp at) {
  const bool all = seen_.size() == names_.size();
  const bool told = all || body_.weigh(seen_, at);
  for (std::size_t m = 0; m < places_.size(); ++m) {
    Place& place = places_[m];
    place.at = body_.told(m);
    place.known = told && place.at.allFinite();
    if (believed_[m]) {
      place.covariance_m2 = ball(kFitted_m);
    } else if (place.known) {
      place.covariance_m2 = body_.told_covariance(m) + ball(kFitted_m);
      place.known = place.covariance_m2.allFinite();
    }
  }
}

void SubjectLabeller::consider(std::size_t marker, std::size_t index, const NamedTracks& tracks, double bonus) {
  const TrackedMarker& track = (*tracks.tracked)[index];
  const Place& place = places_[marker];
  const Eigen::Vector3d off = track.position.v - place.at;
  if (!(off.norm() < settings_.most_gate_m)) return;
  const bool own = names_[marker].index == static_cast<int>(index);
  const bool called = track.expected_label == Label{id_, static_cast<std::uint32_t>(marker)};
  if (track.state == TrackState::Tentative && !called && !own) return;
  const Eigen::Matrix3d spread =
      place.covariance_m2 + track.covariance_m2 + ball(believed_[marker] ? 0.0 : off.squaredNorm() / (2.0 * kLimb_m));
  const double apart = off.dot(spread.inverse() * off);
  if (!(apart < kGateSigmas * kGateSigmas)) return;
  if (!own && !tied(marker, track.position.v, tracks)) return;
  const double width = std::log(spread.determinant() / std::pow(kFitted_m, 6));
  const double cost = apart + std::max(0.0, width) - (own ? bonus : 0.0);
  if (pairs_.size() < kMostPairs)
    pairs_.push_back({static_cast<std::uint32_t>(marker), static_cast<std::uint32_t>(index), cost});
}

void SubjectLabeller::propose(const NamedTracks& tracks, double bonus) {
  pairs_.clear();
  for (std::size_t m = 0; m < names_.size(); ++m) before_[m] = names_[m].index;
  for (std::size_t i = 0; i < tracks.named.size(); ++i) {
    const TrackedMarker& track = (*tracks.tracked)[i];
    if (track.state == TrackState::Coasting || !track.position.v.allFinite() || !track.covariance_m2.allFinite())
      continue;
    const int index = static_cast<int>(i);
    const bool others = tracks.named[i] && std::find(before_.begin(), before_.end(), index) == before_.end();
    if (others) continue;
    for (std::size_t m = 0; m < names_.size(); ++m) {
      if (places_[m].known) consider(m, i, tracks, bonus);
    }
  }
}

// Whether no name that stays alone wants this track, and no track that stays alone suits this name, about as much.
bool SubjectLabeller::settled(const geometry::AllowedPair& claim, std::span<const std::uint32_t> columns) const {
  return std::none_of(pairs_.begin(), pairs_.end(), [&](const geometry::AllowedPair& other) {
    if (other.cost > claim.cost + kClearMargin) return false;
    if (other.column == claim.column && other.row != claim.row) return columns[other.row] == geometry::Assigner::kAlone;
    if (other.row == claim.row && other.column != claim.column)
      return std::find(columns.begin(), columns.end(), other.column) == columns.end();
    return false;
  });
}

void SubjectLabeller::assign(NamedTracks& tracks) {
  const auto columns = assigner_.assign(names_.size(), tracks.named.size(), pairs_, kAlone);
  // All that lose their track let go of it before others take it.
  for (std::size_t m = 0; m < names_.size(); ++m) {
    const bool stays = before_[m] >= 0 && columns[m] == static_cast<std::uint32_t>(before_[m]);
    const bool coasts = before_[m] >= 0 && columns[m] == geometry::Assigner::kAlone && !seen(m, tracks);
    if (!stays && !coasts) free(m, tracks);
  }
  for (const geometry::AllowedPair& pair : pairs_) {
    const bool taken = columns[pair.row] == pair.column;
    if (!taken || before_[pair.row] == static_cast<int>(pair.column) || !settled(pair, columns)) continue;
    give(pair.row, static_cast<int>(pair.column), kFreshConfidence, tracks);
  }
}

// What is off its place by much more than the body's markers are commonly is not shown as seen, though the name may
// stay; what stays off, or is off grossly, loses it.
double SubjectLabeller::most_off() const { return kOff_m + 3.0 * usual_off_m_; }

void SubjectLabeller::contradict(NamedTracks& tracks) {
  bool fitted = true;
  seen_.clear();
  for (std::size_t m = 0; m < names_.size(); ++m) {
    const bool named = seen(m, tracks);
    fitted = fitted && named == believed_[m] && (!named || names_[m].index == before_[m]);
    if (named) seen_.push_back(observe(m, tracks));
  }
  if (!fitted) (void)body_.fit(seen_);
  const double most = most_off();
  double sum = 0.0;
  std::size_t left = 0;
  for (const body::Observation& one : seen_) {
    const auto m = static_cast<std::size_t>(one.marker);
    Name& name = names_[m];
    const double off = (one.position - body_.told(m)).norm();
    believed_[m] = off < most;
    name.doubt = off > 2.0 * most ? kMostDoubt : off > most ? name.doubt + 1 : std::max(0, name.doubt - 1);
    name.confidence += 0.1F * ((believed_[m] ? 1.0F : 0.3F) - name.confidence);
    if (name.doubt >= kMostDoubt) free(m, tracks);
    if (!believed_[m]) continue;
    sum += off;
    seen_[left++] = one;
  }
  if (left > 0) usual_off_m_ += 0.05 * (sum / static_cast<double>(left) - usual_off_m_);
  if (left == seen_.size()) return;
  seen_.erase(seen_.begin() + static_cast<std::ptrdiff_t>(left), seen_.end());
  (void)body_.fit(seen_);
}

void SubjectLabeller::read(NamedTracks& tracks, Timestamp at) {
  body_.predict(at);
  trust(tracks, at);
  (void)body_.fit(seen_);
  place(at);
  propose(tracks, kOwnBonus);
  assign(tracks);
  contradict(tracks);
  reconsider(tracks);
  body_.learn(seen_);
}

void SubjectLabeller::judge(NamedTracks& tracks, Timestamp at) {
  std::size_t count = 0;
  for (std::size_t m = 0; m < names_.size(); ++m) count += seen(m, tracks) ? 1 : 0;
  if (4 * count >= names_.size() && count >= 3) enough_at_ = at;
  if (at - enough_at_ <= settings_.lost_after) return;
  for (std::size_t m = 0; m < names_.size(); ++m) free(m, tracks);
  phase_ = SubjectPhase::Lost;
}

bool SubjectLabeller::recognise(std::span<const Eigen::Vector3d> points, std::span<const int> track_of_point,
                                NamedTracks& tracks, Timestamp at) {
  const std::optional<body::FoundBody>& found = rigid() ? shape_.find(points) : tpose_.find(points);
  if (!found) return false;
  for (std::size_t m = 0; m < names_.size(); ++m) {
    const int point = found->point_of_marker[m];
    names_[m] = {};
    if (point >= 0) give(m, track_of_point[static_cast<std::size_t>(point)], kFreshConfidence, tracks);
  }
  learn(*found);
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
  enough_at_ = at;
  return true;
}

void SubjectLabeller::learn(const body::FoundBody& found) {
  if (rigid()) return;
  for (std::size_t b = 0; b < set_.skeleton.bones.size(); ++b) {
    set_.skeleton.bones[b].rest_offset_m = found.rest_offsets_m[b];
  }
  for (std::size_t m = 0; m < names_.size(); ++m) set_.markers[m].offset_m = found.marker_offsets_m[m];
  ties_.refit(set_);
  body_.refit(found.rest_offsets_m, found.marker_offsets_m);
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
  ties_.refit(set_);
  body_.refit(fit.rest_offsets_m, fit.marker_offsets_m);
}

std::optional<SubjectFit> SubjectLabeller::take_fit() {
  std::optional<SubjectFit> fit = fit_;
  fit_.reset();
  return fit;
}

}  // namespace mocap::stages
