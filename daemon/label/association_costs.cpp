// The part of SubjectLabeller that says which tracks its names may have, and takes names back.

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "label/subject_labeller.h"

namespace mocap::label {
namespace {

// A contradiction must last for as many sets before a name is taken back; a gross one counts as all of them.
constexpr int kMostDoubt = 3;
constexpr double kOff_m = 0.012;
// A marker's own share of that is learnt slowly: where skin slides or a joint was placed wrongly it is off by more.
constexpr double kMostUsual_m = 0.02;
constexpr double kLearnUsual = 0.03;
// A name that was held for about 20 sets is long held. Its bones may vouch for it up to a limb's thickness; they do not
// where a distance is three sigmas off.
constexpr float kLongHeld = 0.85F;
constexpr double kMostVouched_m = 0.08;
constexpr double kTieContradicts = 4.5;
constexpr double kGateSigmas = 4.0;
constexpr double kNeighbourSigmas = 7.0;  // a claim may be a neighbour's that is as far off as that
constexpr double kContestGates = 2.0;
constexpr double kFitted_m = 0.008;
// What a turn bends out of a straight line is a square's half over the limb's length.
constexpr double kLimb_m = 0.35;
// In squared sigmas: what a name's own track is preferred by.
constexpr double kOwnBonus = 6.0;

double slack_of(const identify::Tie& tie, double base_m) { return base_m + 0.05 * tie.most_m; }

Eigen::Matrix3d ball(double sigma_m) { return sigma_m * sigma_m * Eigen::Matrix3d::Identity(); }

}  // namespace

// Whether the distances to the neighbours that are seen allow a marker to be there.
bool SubjectLabeller::tied(std::size_t marker, const Eigen::Vector3d& at, const NamedTracks& tracks) const {
  int kept = 0;
  int broken = 0;
  for (const identify::Tie& tie : ties_.of(marker)) {
    const auto other = static_cast<std::size_t>(tie.other);
    if (!believed_[other] || !seen(other, tracks)) continue;
    const double apart = (tracks[names_[other].index].position.v - at).norm();
    const double over = std::max(tie.least_m - apart, apart - tie.most_m);
    (over > slack_of(tie, settings_.tie_slack_m) ? broken : kept) += 1;
  }
  return broken <= kept / 3;
}

// Seen in this set, and no body is sure of it.
bool SubjectLabeller::stray(std::size_t track, const NamedTracks& tracks) const {
  const TrackedMarker& one = (*tracks.tracked)[track];
  return !tracks.sure[track] && one.state != TrackState::Coasting && one.position.v.allFinite() &&
         one.covariance_m2.allFinite();
}

Eigen::Matrix3d SubjectLabeller::spread_of(std::size_t marker, const TrackedMarker& track) const {
  const Place& place = places_[marker];
  const double bent_m = believed_[marker] ? 0.0 : (track.position.v - place.at).squaredNorm() / (2.0 * kLimb_m);
  return place.covariance_m2 + track.covariance_m2 + ball(bent_m);
}

bool SubjectLabeller::near(std::size_t marker, std::uint32_t track, const NamedTracks& tracks) const {
  const TrackedMarker& one = (*tracks.tracked)[track];
  const Eigen::Vector3d off = one.position.v - places_[marker].at;
  if (!(off.norm() < settings_.most_gate_m)) return false;
  return off.dot(spread_of(marker, one).inverse() * off) < kGateSigmas * kGateSigmas;
}

bool SubjectLabeller::may_be_neighbours(std::size_t marker, std::uint32_t track, double below,
                                        const NamedTracks& tracks) const {
  const std::span<const identify::Tie> ties = ties_.of(marker);
  return std::any_of(ties.begin(), ties.end(), [&](const identify::Tie& tie) {
    const auto other = static_cast<std::size_t>(tie.other);
    if (names_[other].index >= 0 || !places_[other].known) return false;
    geometry::AllowedPair pair;
    consider(other, track, tracks, pair, kNeighbourSigmas);
    return pair.cost < below;
  });
}

// The cost is infinite where the track cannot be the marker.
void SubjectLabeller::consider(std::size_t marker, std::size_t index, const NamedTracks& tracks,
                               geometry::AllowedPair& into, double most_sigmas) const {
  into.cost = std::numeric_limits<double>::infinity();
  const TrackedMarker& track = (*tracks.tracked)[index];
  const Place& place = places_[marker];
  const Eigen::Vector3d off = track.position.v - place.at;
  if (!(off.norm() < kContestGates * settings_.most_gate_m)) return;
  const bool own = before_[marker] == static_cast<int>(index);
  const bool called = track.expected_label == Label{id_, static_cast<std::uint32_t>(marker)};
  if (track.state == TrackState::Tentative && !called && !own) return;
  const Eigen::Matrix3d spread = spread_of(marker, track);
  const double apart = off.dot(spread.inverse() * off);
  if (!(apart < most_sigmas * most_sigmas)) return;
  if (!own && !tied(marker, track.position.v, tracks)) return;
  const double width = std::log(spread.determinant() / std::pow(kFitted_m, 6));
  into.cost = apart + std::max(0.0, width) - kOwnBonus * hint_of(marker, static_cast<int>(index), tracks);
}

void SubjectLabeller::claim(const NamedTracks& tracks, std::size_t first_row, std::size_t most,
                            std::vector<geometry::AllowedPair>& pairs) {
  claims_ = false;
  if (seen_.size() == names_.size()) return;
  strays_.clear();
  for (std::size_t i = 0; i < tracks.named.size(); ++i) {
    if (stray(i, tracks)) strays_.push_back(static_cast<int>(i));
  }
  if (strays_.empty()) return;
  claims_ = true;
  place();
  geometry::AllowedPair pair;
  const auto add = [&](std::size_t marker, std::size_t index) {
    pair.row = static_cast<std::uint32_t>(first_row + marker);
    pair.column = static_cast<std::uint32_t>(index);
    consider(marker, index, tracks, pair);
    if (std::isfinite(pair.cost) && pairs.size() < most) pairs.push_back(pair);
  };
  for (std::size_t m = 0; m < names_.size(); ++m) {
    if (!places_[m].known) continue;
    if (believed_[m]) add(m, static_cast<std::size_t>(before_[m]));
    for (const int i : strays_) add(m, static_cast<std::size_t>(i));
  }
}

void SubjectLabeller::let_go(std::span<const std::uint32_t> columns, NamedTracks& tracks) {
  for (std::size_t m = 0; m < names_.size(); ++m) {
    const bool stays = before_[m] >= 0 && columns[m] == static_cast<std::uint32_t>(before_[m]);
    const bool coasts = before_[m] >= 0 && columns[m] == geometry::Assigner::kAlone && !seen(m, tracks);
    if (!stays && !coasts) free(m, tracks);
  }
}

void SubjectLabeller::take(std::size_t marker, std::uint32_t track, NamedTracks& tracks) {
  give(marker, static_cast<int>(track), kFreshConfidence, tracks);
}

// What is off its place by much more than it and all the body's markers are commonly is not shown as seen, though the
// name may stay; what stays off, or is off grossly, loses it.
double SubjectLabeller::most_off(std::size_t marker) const {
  return kOff_m + 2.0 * usual_off_m_ + 2.0 * std::min(kMostUsual_m, names_[marker].usual_off_m);
}

// Whether a name that was held for long is where its neighbours want it, though the pose does not reach: joints turn
// farther than the model thinks, and fits go astray, but bones keep their lengths.
bool SubjectLabeller::vouched(std::size_t marker, double off_m, const NamedTracks& tracks) const {
  if (off_m > kMostVouched_m || names_[marker].confidence < kLongHeld) return false;
  const Eigen::Vector3d& at = tracks[names_[marker].index].position.v;
  int rigid = 0;
  int kept = 0;
  for (const identify::Tie& tie : ties_.of(marker)) {
    const auto other = static_cast<std::size_t>(tie.other);
    if (!believed_[other] || !seen(other, tracks)) continue;
    if (TieReader::cost_of(tie, (tracks[names_[other].index].position.v - at).norm()) > kTieContradicts) return false;
    ++kept;
    rigid += tie.rigid ? 1 : 0;
  }
  if (rigid < 1 || kept < 2) return false;
  // Nobody vouches for two that may have exchanged their tracks.
  return std::none_of(seen_.begin(), seen_.end(), [&](const kinematics::Observation& other) {
    const auto b = static_cast<std::size_t>(other.marker);
    if (b == marker || (at - body_.told(b)).norm() >= off_m) return false;
    return (other.position - body_.told(marker)).norm() < off_m;
  });
}

void SubjectLabeller::contradict(NamedTracks& tracks) {
  bool fitted = true;
  seen_.clear();
  for (std::size_t m = 0; m < names_.size(); ++m) {
    const bool named = seen(m, tracks);
    trusted_[m] = believed_[m] && names_[m].index == before_[m];
    fitted = fitted && named == believed_[m] && (!named || names_[m].index == before_[m]);
    believed_[m] = named;
    if (named) seen_.push_back(observe(m, tracks));
  }
  if (!fitted) (void)body_.fit(seen_);
  double sum = 0.0;
  std::size_t left = 0;
  for (const kinematics::Observation& one : seen_) {
    const auto m = static_cast<std::size_t>(one.marker);
    Name& name = names_[m];
    const double off = (one.position - body_.told(m)).norm();
    const double most = most_off(m);
    const bool vouch = off >= most && trusted_[m] && vouched(m, off, tracks);
    believed_[m] = off < most || vouch;
    name.doubt = vouch ? 0 : off > 2.0 * most ? kMostDoubt : off > most ? name.doubt + 1 : std::max(0, name.doubt - 1);
    name.confidence += 0.1F * ((vouch ? kLongHeld : believed_[m] ? 1.0F : 0.3F) - name.confidence);
    // What its own motion or the body's did not lead to must prove itself anew.
    if (!trusted_[m]) name.confidence = std::min(name.confidence, kFreshConfidence);
    if (name.confidence >= kLongHeld) hold(m);
    if (name.doubt >= kMostDoubt) {
      free(m, tracks);
      misread_[static_cast<std::size_t>(set_.markers[m].bone)] = 1;
    }
    if (!believed_[m]) continue;
    sum += off;
    name.usual_off_m += kLearnUsual * (off - name.usual_off_m);
    seen_[left++] = one;
  }
  if (left > 0) usual_off_m_ += 0.05 * (sum / static_cast<double>(left) - usual_off_m_);
  if (left == seen_.size()) return;
  seen_.erase(seen_.begin() + static_cast<std::ptrdiff_t>(left), seen_.end());
  (void)body_.fit(seen_);
}

}  // namespace mocap::label
