#include "stages/label_subject.h"

#include <algorithm>
#include <cmath>

#include "base/expects.h"

namespace mocap::stages {
namespace {

// A contradiction must last for as many sets before a name is taken back; a gross one counts as all of them.
constexpr int kMostDoubt = 3;
// More points than any T-pose with its ghosts has; bounds the cost of a search.
constexpr std::size_t kMostPoints = 160;
constexpr std::size_t kMostClaims = 4096;
// A place known to this is looked for no closer than this: what one set of motion may add.
constexpr double kLeastGate_m = 0.05;
// A claim must beat every rival by this much of the gate's square, or wait.
constexpr double kClearMargin = 0.08;
constexpr float kFreshConfidence = 0.6F;

double slack_of(const body::Tie& tie, double base_m) { return base_m + 0.05 * tie.most_m; }

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
      assigner_(set_.markers.size(), kMaxMarkers, kMostClaims) {
  MOCAP_EXPECTS(set_.markers.size() <= kMaxLabels);
  names_.resize(set_.markers.size());
  claims_.reserve(kMostClaims);
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
    if (name.index < 0 || !(*tracks.tracked)[static_cast<std::size_t>(name.index)].position.v.allFinite()) {
      name = {};
    } else {
      tracks.named[static_cast<std::size_t>(name.index)] = true;
    }
  }
}

SubjectLabeller::Agreement SubjectLabeller::agreement(std::size_t marker, const Eigen::Vector3d& at,
                                                      const NamedTracks& tracks) const {
  Agreement sum;
  for (const body::Tie& tie : ties_.of(marker)) {
    const auto other = static_cast<std::size_t>(tie.other);
    if (!seen(other, tracks)) continue;
    const auto index = static_cast<std::size_t>(names_[other].index);
    const double apart = ((*tracks.tracked)[index].position.v - at).norm();
    const double over = std::max(tie.least_m - apart, apart - tie.most_m);
    const double slack = slack_of(tie, settings_.tie_slack_m);
    if (over > slack) {
      ++sum.broken;
      sum.badly = sum.badly || over > 2.0 * slack;
    } else if (tie.rigid) {
      ++sum.kept;
    }
  }
  return sum;
}

// The most contradicted name goes first: those it contradicted may then be right.
void SubjectLabeller::take_back(NamedTracks& tracks) {
  for (std::size_t round = 0; round < names_.size(); ++round) {
    int worst = 0;
    std::size_t who = names_.size();
    for (std::size_t m = 0; m < names_.size(); ++m) {
      if (!seen(m, tracks)) continue;
      const auto index = static_cast<std::size_t>(names_[m].index);
      const Agreement agrees = agreement(m, (*tracks.tracked)[index].position.v, tracks);
      if (round == 0) {
        const bool contradicted = agrees.broken > agrees.kept;
        names_[m].doubt =
            contradicted ? names_[m].doubt + (agrees.badly ? kMostDoubt : 1) : std::max(0, names_[m].doubt - 1);
        const float goal = agrees.broken > 0 ? 0.3F : 1.0F;
        names_[m].confidence += 0.1F * (goal - names_[m].confidence);
      }
      if (names_[m].doubt >= kMostDoubt && agrees.broken - agrees.kept > worst) {
        worst = agrees.broken - agrees.kept;
        who = m;
      }
    }
    if (who == names_.size()) return;
    free(who, tracks);
  }
}

void SubjectLabeller::consider(std::size_t marker, const ExpectedMarker& expected, int index,
                               const NamedTracks& tracks) {
  const auto i = static_cast<std::size_t>(index);
  const TrackedMarker& track = (*tracks.tracked)[i];
  const bool called = track.expected_label == Label{id_, static_cast<std::uint32_t>(marker)};
  if (track.state == TrackState::Coasting || (track.state == TrackState::Tentative && !called)) return;
  const double sigma = std::sqrt(std::max(0.0, expected.covariance_m2.trace() / 3.0));
  const double gate = std::clamp(4.0 * sigma, kLeastGate_m, settings_.most_gate_m);
  const double off = (track.position.v - expected.position.v).norm();
  if (!(off < gate)) return;
  const Agreement agrees = agreement(marker, track.position.v, tracks);
  // Where no neighbour is seen that could tell, only a place that is just right will do.
  if (agrees.broken > 0 || (agrees.kept == 0 && off > 0.5 * gate)) return;
  const double cost = off * off / (gate * gate) * (called ? 0.5 : 1.0);
  if (claims_.size() < kMostClaims) {
    claims_.push_back({static_cast<std::uint32_t>(marker), static_cast<std::uint32_t>(index), cost});
  }
}

void SubjectLabeller::gather_claims(const NamedTracks& tracks, const Expected& expected) {
  claims_.clear();
  for (const ExpectedMarker& one : expected.markers) {
    if (one.label.subject != id_ || one.label.marker >= names_.size()) continue;
    const std::size_t marker = one.label.marker;
    if (names_[marker].index >= 0) continue;
    for (std::size_t i = 0; i < tracks.named.size(); ++i) {
      if (!tracks.named[i]) consider(marker, one, static_cast<int>(i), tracks);
    }
  }
}

// Whether no other free name wants this track, and this name no other track, about as much.
bool SubjectLabeller::settled(std::uint32_t marker, std::uint32_t index, double cost) const {
  return std::none_of(claims_.begin(), claims_.end(), [&](const geometry::AllowedPair& other) {
    const bool same = other.row == marker && other.column == index;
    const bool rival = other.row == marker || other.column == index;
    return rival && !same && other.cost < cost + kClearMargin;
  });
}

void SubjectLabeller::claim(NamedTracks& tracks, const Expected& expected) {
  gather_claims(tracks, expected);
  if (claims_.empty()) return;
  const auto columns = assigner_.assign(names_.size(), tracks.named.size(), claims_, 1.0);
  for (const geometry::AllowedPair& claim : claims_) {
    if (columns[claim.row] != claim.column || !settled(claim.row, claim.column, claim.cost)) continue;
    give(claim.row, static_cast<int>(claim.column), kFreshConfidence, tracks);
  }
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
    label.state = track.state == TrackState::Coasting ? LabelState::Filled : LabelState::Measured;
    label.position = track.position;
    label.covariance_m2 = track.covariance_m2;
    label.residual_px = track.residual_px;
    label.cameras = track.cameras;
    label.confidence = name.confidence;
    label.track = track.id;
  }
}

std::optional<SubjectFit> SubjectLabeller::take_fit() {
  std::optional<SubjectFit> fit = fit_;
  fit_.reset();
  return fit;
}

}  // namespace mocap::stages
