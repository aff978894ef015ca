#include "stages/claim_tracks.h"

#include <algorithm>

namespace mocap::stages {
namespace {

constexpr std::size_t kMostPairs = 8192;
// In squared sigmas: what leaving a name alone costs, and what a new claim must be better by than any other reading
// (odds of 150 : 1); a closer one waits until its limb is read as a whole.
constexpr double kAlone = 30.0;
constexpr double kClearMargin = 10.0;
// Motion foresees a marker better than that.
constexpr double kSuspect_m = 0.008;

}  // namespace

TrackClaims::TrackClaims(std::size_t most_names)
    : most_names_(most_names), assigner_(std::max<std::size_t>(most_names, 1), kMaxMarkers, kMostPairs) {
  pairs_.reserve(kMostPairs);
  first_row_.reserve(kMaxSubjects);
  suspects_.reserve(most_names);
}

// Two names that would each be nearer to their place with the other's track may have exchanged them: then neither is
// believed, and both must win their tracks back.
void TrackClaims::doubt_exchanged(std::vector<SubjectLabeller>& subjects, const NamedTracks& tracks) {
  suspects_.clear();
  for (std::size_t s = 0; s < subjects.size(); ++s) {
    if (!subjects[s].tracking()) continue;
    for (std::size_t m = 0; m < subjects[s].names(); ++m) {
      const auto off = subjects[s].place_of(m, tracks);
      if (off && (off->at - off->told).squaredNorm() > kSuspect_m * kSuspect_m)
        suspects_.push_back({s, m, off->at, off->told});
    }
  }
  for (std::size_t i = 0; i < suspects_.size(); ++i) {
    for (std::size_t j = i + 1; j < suspects_.size(); ++j) {
      const Suspect& a = suspects_[i];
      const Suspect& b = suspects_[j];
      const double now = (a.at - a.told).squaredNorm() + (b.at - b.told).squaredNorm();
      const double exchanged = (a.at - b.told).squaredNorm() + (b.at - a.told).squaredNorm();
      if (exchanged + kSuspect_m * kSuspect_m >= now) continue;
      subjects[a.subject].doubt(a.marker);
      subjects[b.subject].doubt(b.marker);
    }
  }
}

// Whether no name that stays alone wants this track, and no track that stays alone suits this name, about as much.
bool TrackClaims::is_clear(const geometry::AllowedPair& claim, std::span<const std::uint32_t> columns) const {
  return std::none_of(pairs_.begin(), pairs_.end(), [&](const geometry::AllowedPair& other) {
    if (other.cost > claim.cost + kClearMargin) return false;
    if (other.column == claim.column && other.row != claim.row) return columns[other.row] == geometry::Assigner::kAlone;
    if (other.row == claim.row && other.column != claim.column)
      return std::find(columns.begin(), columns.end(), other.column) == columns.end();
    return false;
  });
}

void TrackClaims::settle(std::vector<SubjectLabeller>& subjects, NamedTracks& tracks) {
  doubt_exchanged(subjects, tracks);
  for (SubjectLabeller& subject : subjects) {
    if (subject.tracking()) subject.fit(tracks);
  }
  pairs_.clear();
  first_row_.clear();
  std::size_t rows = 0;
  for (SubjectLabeller& subject : subjects) {
    first_row_.push_back(rows);
    if (!subject.tracking()) continue;
    subject.claim(tracks, rows, kMostPairs, pairs_);
    rows += subject.names();
  }
  if (pairs_.empty()) return;
  const auto columns = assigner_.assign(rows, tracks.named.size(), pairs_, kAlone);
  // All that lose their track let go of it before others take it.
  for (std::size_t s = 0; s < subjects.size(); ++s) {
    if (subjects[s].claims()) subjects[s].let_go(columns.subspan(first_row_[s], subjects[s].names()), tracks);
  }
  for (const geometry::AllowedPair& pair : pairs_) {
    if (columns[pair.row] != pair.column) continue;
    const auto above = std::upper_bound(first_row_.begin(), first_row_.end(), pair.row);
    const auto s = static_cast<std::size_t>(above - first_row_.begin()) - 1;
    const std::size_t marker = pair.row - first_row_[s];
    const bool own = subjects[s].bears(marker, pair.column);
    if (own && !subjects[s].jumped(marker)) continue;
    const bool clear = is_clear(pair, columns);
    if (own && !clear) subjects[s].drop(marker, tracks);
    if (!own && clear && subjects[s].near(marker, pair.column, tracks)) subjects[s].take(marker, pair.column, tracks);
  }
}

}  // namespace mocap::stages
