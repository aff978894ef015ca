#include "label/track_association.h"

#include <algorithm>
#include <limits>

namespace mocap::label {
namespace {

constexpr std::size_t kMostPairs = 8192;
// In squared sigmas: what leaving a name alone costs, and what a new claim must be better by than any other reading
// (odds of 150 : 1); a closer one waits until its limb is read as a whole.
constexpr double kAlone = 30.0;
constexpr double kClearMargin = 10.0;
// The same of two names that would have each other's track (odds of 12 : 1): where a limb is not known all its markers
// are off alike, and which is which is nearly even; names of unlike limbs are told by far less.
constexpr double kExchangeMargin = 5.0;
// What costs more is not where its bone's other markers want it. All names of a limb that is not known are off alike,
// and which of them is nearest to a track says little: a missing neighbour must then be worse by the second (a limb
// that moves is seldom where it is thought to be as surely as it is thought), or the whole limb says which it is.
constexpr double kExact = 6.0;
constexpr double kNeighbourMargin = 24.0;
// Motion foresees a marker better than that.
constexpr double kSuspect_m = 0.008;

}  // namespace

TrackClaims::TrackClaims(std::size_t most_names)
    : most_names_(most_names), assigner_(std::max<std::size_t>(most_names, 1), kMaxMarkers, kMostPairs) {
  pairs_.reserve(kMostPairs);
  first_row_.reserve(kMaxSubjects);
  suspects_.reserve(most_names);
  first_pair_.reserve(most_names + 1);
  row_of_.reserve(kMaxMarkers);
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

void TrackClaims::index(std::size_t rows, std::span<const std::uint32_t> columns) {
  first_pair_.assign(rows + 1, 0);
  row_of_.assign(kMaxMarkers, geometry::Assigner::kAlone);
  for (const geometry::AllowedPair& pair : pairs_) ++first_pair_[pair.row + 1];
  for (std::size_t row = 0; row < rows; ++row) {
    first_pair_[row + 1] += first_pair_[row];
    if (columns[row] != geometry::Assigner::kAlone) row_of_[columns[row]] = static_cast<std::uint32_t>(row);
  }
}

double TrackClaims::cost_of(std::uint32_t row, std::uint32_t column) const {
  for (std::size_t i = first_pair_[row]; i < first_pair_[row + 1]; ++i) {
    if (pairs_[i].column == column) return pairs_[i].cost;
  }
  return std::numeric_limits<double>::infinity();
}

// Whether this name and another may as well have each other's track. Where a limb is, no name knows by itself: two of
// one bone are off alike, which of them is which is then for the whole limb to say.
bool TrackClaims::may_exchange(const geometry::AllowedPair& claim, std::span<const std::uint32_t> columns) const {
  for (std::size_t i = first_pair_[claim.row]; i < first_pair_[claim.row + 1]; ++i) {
    const geometry::AllowedPair& instead = pairs_[i];
    const std::uint32_t other = instead.column == claim.column ? geometry::Assigner::kAlone : row_of_[instead.column];
    if (other == geometry::Assigner::kAlone) continue;
    const double now = claim.cost + cost_of(other, columns[other]);
    if (instead.cost + cost_of(other, claim.column) < now + kExchangeMargin) return true;
  }
  return false;
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
  index(rows, columns);
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
    const bool clear = is_clear(pair, columns) && !may_exchange(pair, columns);
    if (own && !clear) subjects[s].drop(marker, tracks);
    if (own || !clear) continue;
    if (pair.cost > kExact && subjects[s].may_be_neighbours(marker, pair.column, pair.cost + kNeighbourMargin, tracks))
      continue;
    if (!subjects[s].near(marker, pair.column, tracks) || subjects[s].left_open(marker, pair.column, tracks)) continue;
    subjects[s].take(marker, pair.column, tracks);
  }
}

}  // namespace mocap::label
