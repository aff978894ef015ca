// The part of SubjectLabeller that reads a limb anew where names are missing while nameless tracks stand near.

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "stages/label_subject.h"

namespace mocap::stages {
namespace {

// A name of another limb that is farther away does not want a track.
constexpr double kNear_m = 0.3;
// In half squared sigmas: what a further name is worth, what a track's own name counts, how unlikely it is that a track
// of one or two sets is a marker, that the body followed wrong names; and what a reading must be better by.
constexpr double kWorthAName = 12.0;
constexpr double kOwn = 3.0;
constexpr double kTooYoung = 5.0;
constexpr double kMisread = 6.0;
constexpr double kClearMargin = 5.0;
// What readings that say otherwise must be worse by: one fit may stop short of where another ends.
constexpr double kUndecided = 6.5;
// A name that was given in the last ten sets or so must still be the clear reading when its limb is read anew.
constexpr float kHeld = 0.85F;
// Within so many a missing name of another limb wants a track, too.
constexpr double kWantedSigmas = 3.0;
// Young tracks of fewer cameras may be where rays meet by chance.
constexpr std::uint32_t kLeastCameras = 3;
// Bounds what a set costs.
constexpr int kMostLimbs = 2;
constexpr int kLeastJudged = 1 + static_cast<int>(TieReader::kMostReadings);

}  // namespace

// What the ties to the names that are not read anew say against a place.
double SubjectLabeller::anchored(std::size_t marker, const Eigen::Vector3d& at, const NamedTracks& tracks) const {
  double sum = 0.0;
  for (const body::Tie& tie : ties_.of(marker)) {
    const auto other = static_cast<std::size_t>(tie.other);
    if (!believed_[other] || in_limb_[static_cast<std::size_t>(set_.markers[other].bone)]) continue;
    sum += TieReader::cost_of(tie, (tracks[names_[other].index].position.v - at).norm());
  }
  const auto bone = static_cast<std::size_t>(set_.markers[marker].bone);
  const int parent = set_.skeleton.bones[bone].parent;
  if (parent < 0 || in_limb_[static_cast<std::size_t>(parent)]) return sum;
  const double length_m = set_.markers[marker].offset_m.norm();
  const body::Tie to_joint{0, length_m, length_m, true};
  const auto told = body_.told_by_markers(static_cast<std::size_t>(parent));
  if (told != body::BodyFollower::Told::Direct) return sum;
  return sum + TieReader::cost_of(to_joint, (body_.pose().world()[bone].position - at).norm());
}

// Whether a track may be where rays meet by chance. One that bore a name of the limb or was looked for as one is a
// marker, whichever name it has now.
bool SubjectLabeller::too_young(int index, const NamedTracks& tracks) const {
  if (tracks[index].state != TrackState::Tentative) return false;
  for (std::size_t n = 0; n < reader_.names(); ++n) {
    const std::size_t m = reader_.marker(n);
    const bool called = tracks[index].expected_label == Label{id_, static_cast<std::uint32_t>(m)};
    if (called || hint_of(m, index, tracks) > 0.0) return false;
  }
  return true;
}

void SubjectLabeller::allow_places(const NamedTracks& tracks) {
  for (std::size_t n = 0; n < reader_.names(); ++n) {
    const std::size_t m = reader_.marker(n);
    for (std::size_t p = 0; p < reader_.places(); ++p) {
      const bool young = too_young(place_track_[p], tracks);
      if (young && tracks[place_track_[p]].cameras < kLeastCameras) continue;
      const double own = kOwn * hint_of(m, place_track_[p], tracks);
      reader_.allow(n, p, anchored(m, reader_.place(p), tracks) + (young ? kTooYoung : 0.0) - own);
    }
  }
}

// What the body says to it, and the worth of the names that it leaves out.
void SubjectLabeller::judge_reading(Reading& reading, const Reading& now, const NamedTracks& tracks) {
  --left_;
  tried_.clear();
  for (const body::Observation& one : seen_) {
    if (!in_limb_[static_cast<std::size_t>(set_.markers[static_cast<std::size_t>(one.marker)].bone)])
      tried_.push_back(one);
  }
  reading.cost = 0.0;
  std::copy(misread_.begin(), misread_.end(), loose_.begin());
  bool contradicts = false;
  for (std::size_t n = 0; n < reader_.names(); ++n) {
    const std::size_t m = reader_.marker(n);
    const int track = reading.track_of[n];
    if (now.track_of[n] >= 0 && track != now.track_of[n]) {
      contradicts = true;
      loose_[static_cast<std::size_t>(set_.markers[m].bone)] = 1;
    }
    if (track < 0) {
      reading.cost += kWorthAName;
      continue;
    }
    tried_.push_back(observe(m, track, tracks));
    reading.cost += (too_young(track, tracks) ? kTooYoung : 0.0) - kOwn * hint_of(m, track, tracks);
  }
  if (contradicts) reading.cost += kMisread;
  body_.misread(loose_);
  double least = std::numeric_limits<double>::infinity();
  for (const Reading* other = readings_.data(); other != &reading; ++other) least = std::min(least, other->cost);
  reading.cost += body_.explain(tried_, least + kUndecided - reading.cost).cost;
}

void SubjectLabeller::adopt(const Reading& reading, NamedTracks& tracks) {
  std::copy(misread_.begin(), misread_.end(), loose_.begin());
  for (std::size_t n = 0; n < reader_.names(); ++n) {
    const std::size_t m = reader_.marker(n);
    if (names_[m].index == reading.track_of[n] && names_[m].index >= 0) continue;
    if (believed_[m]) loose_[static_cast<std::size_t>(set_.markers[m].bone)] = 1;
    if (names_[m].index >= 0 && (seen(m, tracks) || reading.track_of[n] >= 0)) free(m, tracks);
  }
  for (std::size_t m = 0; m < names_.size(); ++m) {  // doubtful bearers of what the limb takes
    if (names_[m].index < 0 || in_limb_[static_cast<std::size_t>(set_.markers[m].bone)]) continue;
    const auto* end = reading.track_of.data() + reader_.names();
    if (std::find(reading.track_of.data(), end, names_[m].index) != end) free(m, tracks);
  }
  for (std::size_t n = 0; n < reader_.names(); ++n) {
    const std::size_t m = reader_.marker(n);
    const int track = reading.track_of[n];
    believed_[m] = track >= 0;
    if (track >= 0 && names_[m].index != track) give(m, track, kFreshConfidence, tracks);
  }
  seen_.clear();
  for (std::size_t m = 0; m < names_.size(); ++m) {
    if (believed_[m]) seen_.push_back(observe(m, tracks));
  }
  body_.misread(loose_);
  (void)body_.fit(seen_);
  for (const body::Observation& one : seen_) {
    const auto m = static_cast<std::size_t>(one.marker);
    if ((one.position - body_.told(m)).norm() > most_off(m)) believed_[m] = false;
  }
  std::erase_if(seen_, [&](const body::Observation& one) { return !believed_[static_cast<std::size_t>(one.marker)]; });
}

// Appends those that are not there yet.
void SubjectLabeller::propose(std::span<const TieReader::Reading> found) {
  for (const TieReader::Reading& one : found) {
    Reading other;
    for (std::size_t n = 0; n < reader_.names(); ++n) {
      const int place = one.place_of[n];
      other.track_of[n] = place < 0 ? -1 : place_track_[static_cast<std::size_t>(place)];
    }
    (void)propose(other);
  }
}

bool SubjectLabeller::propose(const Reading& reading) {
  const auto names = static_cast<std::ptrdiff_t>(reader_.names());
  const bool known = std::any_of(readings_.begin(), readings_.end(), [&](const Reading& there) {
    return std::equal(there.track_of.begin(), there.track_of.begin() + names, reading.track_of.begin());
  });
  if (!known) readings_.push_back(reading);
  return !known;
}

const SubjectLabeller::Reading& SubjectLabeller::best_reading() const {
  return *std::min_element(readings_.begin(), readings_.end(),
                           [](const Reading& a, const Reading& b) { return a.cost < b.cost; });
}

// The cheapest readings by distances may all agree on a name because they differ in others: what speaks against each
// new name is looked for on purpose. A name for which no work is left is not given in this set.
std::bitset<TieReader::kMostNames> SubjectLabeller::challenge(const NamedTracks& tracks) {
  std::bitset<TieReader::kMostNames> unchallenged;
  const Reading best = best_reading();
  TieReader::Reading places;
  for (std::size_t n = 0; n < reader_.names(); ++n) {
    const auto found = std::find(place_track_.begin(), place_track_.end(), best.track_of[n]);
    const bool there = best.track_of[n] >= 0 && found != place_track_.end();
    places.place_of[n] = static_cast<std::int8_t>(there ? found - place_track_.begin() : TieReader::kNowhere);
  }
  for (std::size_t n = 0; n < reader_.names(); ++n) {
    const int track = best.track_of[n];
    if (track < 0 || track == readings_[0].track_of[n] || places.place_of[n] < 0) continue;
    const bool doubted = std::any_of(readings_.begin(), readings_.end(), [&](const Reading& other) {
      return other.track_of[n] != track && other.cost <= best.cost + kUndecided;
    });
    if (doubted) continue;
    if (left_ < 2 * static_cast<int>(kChallenges)) {
      unchallenged.set(n);
      continue;
    }
    const std::size_t before = readings_.size();
    propose(reader_.read_otherwise(ties_, kWorthAName, n, places, kChallenges));
    TieReader::Reading alone;
    alone.place_of.fill(TieReader::kNowhere);
    alone.place_of[n] = places.place_of[n];
    propose(reader_.read_otherwise(ties_, kWorthAName, n, alone, kChallenges));
    for (std::size_t i = before; i < readings_.size(); ++i) judge_reading(readings_[i], readings_[0], tracks);
  }
  return unchallenged;
}

// Many readings of a limb cost the same by distances, and a short list may lack the one that the pose likes best: from
// the best that is known, each new name is moved to, or exchanged with, each neighbour that is not surely named.
void SubjectLabeller::exchange_neighbours(const NamedTracks& tracks) {
  const std::size_t most = readings_.size() + static_cast<std::size_t>(std::min(kMostExchanged, left_));
  bool better = true;
  while (better) {
    const Reading best = best_reading();
    for (std::size_t a = 0; a < reader_.names(); ++a) {
      if (best.track_of[a] < 0 || readings_[0].track_of[a] >= 0) continue;
      for (const body::Tie& tie : ties_.of(reader_.marker(a))) {
        std::size_t b = 0;
        while (b < reader_.names() && reader_.marker(b) != static_cast<std::size_t>(tie.other)) ++b;
        if (b == reader_.names() || readings_[0].track_of[b] >= 0) continue;
        Reading other = best;
        std::swap(other.track_of[a], other.track_of[b]);
        if (readings_.size() == most || !propose(other)) continue;
        judge_reading(readings_.back(), readings_[0], tracks);
      }
    }
    better = best_reading().cost < best.cost && readings_.size() < most;
  }
}

// Whether a missing name that is no part of the limb may well be this track: two limbs that touch are told from each
// other by claims, or by their motion.
bool SubjectLabeller::wanted_elsewhere(int index, const NamedTracks& tracks) const {
  if (!claims_) return false;
  const TrackedMarker& track = tracks[index];
  for (std::size_t m = 0; m < names_.size(); ++m) {
    if (believed_[m] || !places_[m].known || in_limb_[static_cast<std::size_t>(set_.markers[m].bone)]) continue;
    const Eigen::Vector3d off = track.position.v - places_[m].at;
    if (!(off.squaredNorm() < kNear_m * kNear_m)) continue;
    const Eigen::Matrix3d spread = spread_of(m, track);
    if (off.dot(spread.inverse() * off) < kWantedSigmas * kWantedSigmas) return true;
  }
  return false;
}

// True when the limb is now read otherwise.
bool SubjectLabeller::read_limb(NamedTracks& tracks) {
  readings_.clear();
  Reading& now = readings_.emplace_back();
  for (std::size_t n = 0; n < reader_.names(); ++n) {
    const std::size_t m = reader_.marker(n);
    now.track_of[n] = believed_[m] && names_[m].confidence >= kHeld ? names_[m].index : -1;
  }
  propose(reader_.read(ties_, kWorthAName));
  if (readings_.size() == 1) return false;
  for (Reading& one : readings_) judge_reading(one, readings_[0], tracks);
  std::bitset<TieReader::kMostNames> unchallenged;
  if (best_reading().cost + kClearMargin < readings_[0].cost) {
    exchange_neighbours(tracks);
    unchallenged = challenge(tracks);
  }
  Reading best = best_reading();
  if (!(best.cost + kClearMargin < readings_[0].cost)) {
    body_.misread(misread_);
    (void)body_.fit(seen_);
    return false;
  }
  // On what other readings that are about as good say otherwise, nothing is said.
  for (const Reading& other : readings_) {
    if (other.cost > best.cost + kUndecided) continue;
    for (std::size_t n = 0; n < reader_.names(); ++n) {
      if (other.track_of[n] != best.track_of[n]) best.track_of[n] = -1;
    }
  }
  for (std::size_t n = 0; n < reader_.names(); ++n) {
    if (best.track_of[n] < 0 || best.track_of[n] == readings_[0].track_of[n]) continue;
    if (unchallenged[n] || wanted_elsewhere(best.track_of[n], tracks)) best.track_of[n] = -1;
  }
  adopt(best, tracks);
  return true;
}

void SubjectLabeller::reread(NamedTracks& tracks) {
  for (int& sets : rest_) sets = std::max(0, sets - 1);
  std::fill(trouble_.begin(), trouble_.end(), 0);
  left_ = std::min(kMostJudged, left_ + kJudgedASet);
  if (seen_.size() == names_.size()) {
    std::fill(misread_.begin(), misread_.end(), 0);
    return;
  }
  for (int limb = 0; limb < kMostLimbs; ++limb) {
    for (std::size_t i = 0; i < tracks.sure.size(); ++i) tracks.sure[i] = tracks.named[i];
    for (std::size_t m = 0; m < names_.size(); ++m) {
      if (names_[m].index >= 0) tracks.sure[static_cast<std::size_t>(names_[m].index)] = believed_[m];
    }
    strays_.clear();
    for (std::size_t i = 0; i < tracks.named.size(); ++i) {
      if (stray(i, tracks)) strays_.push_back(static_cast<int>(i));
    }
    const int bone = most_troubled_bone(tracks);
    // A limb that is read in part is read in part again: it waits until there is work for all of it.
    if (bone < 0 || left_ < (limb == 0 ? kMostJudged : kLeastJudged)) return;
    rest_[static_cast<std::size_t>(bone)] = kPatience;
    if (!gather_limb(static_cast<std::size_t>(bone), tracks)) continue;
    for (std::size_t b = 0; b < rest_.size(); ++b) {
      if (loose_[b] != 0) rest_[b] = kPatience;  // read with it
    }
    (void)read_limb(tracks);
  }
}

}  // namespace mocap::stages
