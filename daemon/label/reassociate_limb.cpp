// The part of SubjectLabeller that has limbs read anew where names are missing while nameless tracks stand near.

#include <algorithm>
#include <cmath>

#include "label/subject_labeller.h"

namespace mocap::label {
namespace {

// A name of another limb that is farther away does not want a track.
constexpr double kNear_m = 0.3;
// In squared sigmas, as claims have it: a missing name of another limb wants a track that is as near as that to where
// it is thought to be; one whose place is hardly known, only what the limb's own marker is less likely to be.
constexpr double kWanted = 15.0;
// Bounds what a set costs.
constexpr int kMostLimbs = 2;
// A limb that is not clear is read again before that.
constexpr double kSurmised_s = 0.05;
// How far apart, rms of an axis, the markers may be that a track may be, for it to tell where its limb is.
constexpr double kMostApart_m = 0.1;

}  // namespace

// Below what cost another limb's missing name wants a track that this marker would have: of two limbs that are both
// lost the farther one waits for the nearer.
double SubjectLabeller::wanted_below(std::size_t marker, int index, const NamedTracks& tracks) const {
  if (!places_[marker].known) return kWanted;
  geometry::AllowedPair here;
  consider(marker, static_cast<std::size_t>(index), tracks, here);
  return std::isfinite(here.cost) ? std::max(kWanted, here.cost) : kWanted;
}

// Whether a missing name that is no part of the limb may well be this track, at a cost below that: two limbs that touch
// are told from each other by claims, or by their motion.
bool SubjectLabeller::wanted_elsewhere(int index, double below, const NamedTracks& tracks) const {
  if (!claims_) return false;
  const TrackedMarker& track = tracks[index];
  for (std::size_t m = 0; m < names_.size(); ++m) {
    if (believed_[m] || !places_[m].known || in_limb_[static_cast<std::size_t>(set_.markers[m].bone)]) continue;
    const Eigen::Vector3d off = track.position.v - places_[m].at;
    if (!(off.squaredNorm() < kNear_m * kNear_m)) continue;
    geometry::AllowedPair pair;
    consider(m, static_cast<std::size_t>(index), tracks, pair);
    if (pair.cost < below) return true;
  }
  return false;
}

// Where the limb's names are by what was found, in this set: of sets ago, its tracks may be lost, or have other names.
// False where the limb was named otherwise meanwhile.
bool SubjectLabeller::find_read(const TieReader::Reading& found, const NamedTracks& tracks) {
  for (std::size_t n = 0; n < limb_.names(); ++n) {
    const std::size_t m = limb_.marker(n);
    const int place = found.place_of[n];
    const TrackId id = place < 0 ? TrackId{} : limb_.place(static_cast<std::size_t>(place)).track;
    if (believed_[m] && names_[m].track != begun_with_[n] && names_[m].track != id) return false;
    read_[n] = place < 0 ? NamedTracks::kNone : tracks.find(id);
    if (read_[n] < 0) continue;
    const bool gone = tracks[read_[n]].state == TrackState::Coasting || taken_elsewhere(read_[n]);
    const bool new_there = place != limb_.now(n);
    if (gone ||
        (new_there && (wanted_elsewhere(read_[n], wanted_below(m, read_[n], tracks), tracks) || of_another_limb(id))))
      read_[n] = NamedTracks::kNone;
  }
  return true;
}

// Whether the last reading of another limb left open only which of that limb's markers it is.
bool SubjectLabeller::of_another_limb(TrackId track) const {
  for (std::size_t m = 0; m < names_.size(); ++m) {
    const bool outside = !in_limb_[static_cast<std::size_t>(set_.markers[m].bone)];
    if (outside && names_[m].index < 0 && names_[m].surmised == track && is_surmised(names_[m])) return true;
  }
  return false;
}

// Whether a believed name that is no part of the limb bears it.
bool SubjectLabeller::taken_elsewhere(int track) const {
  for (std::size_t m = 0; m < names_.size(); ++m) {
    const bool outside = !in_limb_[static_cast<std::size_t>(set_.markers[m].bone)];
    if (outside && believed_[m] && names_[m].index == track) return true;
  }
  return false;
}

// The limb's names go where they were read; who bears none there has none.
void SubjectLabeller::adopt(NamedTracks& tracks) {
  std::copy(misread_.begin(), misread_.end(), loose_.begin());
  for (std::size_t n = 0; n < limb_.names(); ++n) {
    const std::size_t m = limb_.marker(n);
    if (names_[m].index == read_[n] && names_[m].index >= 0) continue;
    if (believed_[m]) loose_[static_cast<std::size_t>(set_.markers[m].bone)] = 1;
    if (names_[m].index >= 0 && (seen(m, tracks) || read_[n] >= 0)) free(m, tracks);
  }
  for (std::size_t m = 0; m < names_.size(); ++m) {  // doubtful bearers of what the limb takes
    if (names_[m].index < 0 || in_limb_[static_cast<std::size_t>(set_.markers[m].bone)]) continue;
    const auto end = read_.begin() + static_cast<std::ptrdiff_t>(limb_.names());
    if (std::find(read_.begin(), end, names_[m].index) != end) free(m, tracks);
  }
  for (std::size_t n = 0; n < limb_.names(); ++n) {
    const std::size_t m = limb_.marker(n);
    believed_[m] = read_[n] >= 0;
    if (read_[n] >= 0 && names_[m].index != read_[n]) give(m, read_[n], kFreshConfidence, tracks);
  }
  seen_.clear();
  for (std::size_t m = 0; m < names_.size(); ++m) {
    if (believed_[m]) seen_.push_back(observe(m, tracks));
  }
  body_.misread(loose_);
  (void)body_.fit(seen_);
  for (const kinematics::Observation& one : seen_) {
    const auto m = static_cast<std::size_t>(one.marker);
    if ((one.position - body_.told(m)).norm() > most_off(m)) believed_[m] = false;
  }
  std::erase_if(seen_, [&](const kinematics::Observation& one) { return !believed_[static_cast<std::size_t>(one.marker)]; });
}

// What the likeliest reading has and is not said: a track that is a marker of the limb in all that are about as good,
// and stays one.
void SubjectLabeller::surmise(const NamedTracks& tracks) {
  const TieReader::Reading& likeliest = limb_.likeliest();
  for (std::size_t n = 0; n < limb_.names(); ++n) {
    const int place = likeliest.place_of[n];
    const int said = limb_.found() != nullptr ? limb_.found()->place_of[n] : limb_.now(n);
    if (place < 0 || place == said) continue;
    const LimbReader::Shares shares = limb_.shares_at(place);
    const TrackId id = limb_.place(static_cast<std::size_t>(place)).track;
    const int track = tracks.find(id);
    if (shares[n] == 0.0 || track < 0 || wanted_elsewhere(track, kWanted, tracks)) continue;
    for (Name& other : names_) {
      if (other.surmised == id) other.surmised = {};
    }
    Name& name = names_[limb_.marker(n)];
    name.surmised = id;
    name.surmised_at = at_;
    name.among.clear();
    for (std::size_t other = 0; other < limb_.names(); ++other) {
      if (shares[other] > 0.0)
        name.among.push_back({static_cast<std::uint16_t>(limb_.marker(other)), static_cast<float>(shares[other])});
    }
  }
}

bool SubjectLabeller::is_surmised(const Name& name) const {
  return name.surmised.names_something() && to_s(at_ - name.surmised_at) <= kSurmised_s;
}

bool SubjectLabeller::left_open(std::size_t marker, std::uint32_t track, const NamedTracks& tracks) const {
  const TrackId id = tracks[static_cast<int>(track)].id;
  return std::any_of(names_.begin(), names_.end(), [&](const Name& name) {
    const bool alone = name.among.size() == 1 && name.among[0].marker == marker;
    return name.surmised == id && !alone && is_surmised(name);
  });
}

void SubjectLabeller::show_surmised(const NamedTracks& tracks, std::vector<SurmisedMarker>& into) const {
  for (std::size_t m = 0; m < names_.size(); ++m) {
    const Name& name = names_[m];
    if (name.index >= 0 || !is_surmised(name)) continue;
    const int index = tracks.find(name.surmised);
    if (index < 0 || tracks.named[static_cast<std::size_t>(index)] || !stray(static_cast<std::size_t>(index), tracks))
      continue;
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    double square_m2 = 0.0;
    for (const Share& other : name.among) {
      const Eigen::Vector3d apart = body_.told(m) - body_.told(other.marker);
      mean += static_cast<double>(other.share) * apart;
      square_m2 += static_cast<double>(other.share) * apart.squaredNorm();
    }
    const double sigma_m = std::sqrt(std::max(0.0, square_m2 - mean.squaredNorm()) / 3.0);
    if (sigma_m > kMostApart_m) continue;
    into.push_back({{id_, static_cast<std::uint32_t>(m)}, {tracks[index].position.v + mean}, sigma_m});
  }
}

// Begins with the limb in most trouble. False where there is none.
bool SubjectLabeller::begin_limb(const NamedTracks& tracks) {
  const int bone = most_troubled_bone();
  if (bone < 0) return false;
  rest_[static_cast<std::size_t>(bone)] = kPatience;
  if (!gather_limb(static_cast<std::size_t>(bone), tracks)) return true;
  for (std::size_t b = 0; b < rest_.size(); ++b) {
    if (loose_[b] != 0) rest_[b] = kPatience;  // read with it
  }
  tried_.clear();
  for (const kinematics::Observation& one : seen_) {
    if (!in_limb_[static_cast<std::size_t>(set_.markers[static_cast<std::size_t>(one.marker)].bone)])
      tried_.push_back(one);
  }
  for (std::size_t n = 0; n < limb_.names(); ++n) {
    const std::size_t m = limb_.marker(n);
    begun_with_[n] = believed_[m] ? names_[m].track : TrackId{};
  }
  limb_.begin(ties_, body_, tried_, misread_);
  return true;
}

// A limb whose readings are more than a set has time for is read on in the next.
void SubjectLabeller::reread(NamedTracks& tracks) {
  for (int& sets : rest_) sets = std::max(0, sets - 1);
  std::fill(trouble_.begin(), trouble_.end(), 0);
  if (seen_.size() == names_.size()) {
    std::fill(misread_.begin(), misread_.end(), 0);
    limb_.stop();
    return;
  }
  int left = settings_.limb_work;
  for (int limb = 0; limb < kMostLimbs; ++limb) {
    count_trouble(tracks);
    if (!limb_.busy() && !begin_limb(tracks)) return;
    left -= limb_.advance(ties_, left);
    if (limb_.busy()) return;
    surmise(tracks);
    if (limb_.found() != nullptr && find_read(*limb_.found(), tracks)) {
      adopt(tracks);
    } else {
      body_.misread(misread_);
      (void)body_.fit(seen_);
    }
  }
}

}  // namespace mocap::label
