#include "label/track_association.h"

#include <algorithm>
#include <limits>

namespace mocap::label {
namespace {

constexpr std::size_t kMaxPairs = 8192;
// All costs in chi-square units: an odds ratio of exp(margin / 2). Missed-detection cost: of a label without a track.
// Chosen by hand; not yet measured.
constexpr double kUnassignedCost = 30.0;
// Margin of a new assignment over a label or track that stays unassigned: odds of 150 : 1. Chosen by hand; not yet
// measured. A smaller margin waits for the limb hypothesis.
constexpr double kAssignmentMargin = 10.0;
// Margin over the exchange of the tracks of two labels: odds of 12 : 1 (decision 0003). All markers of a limb with
// unknown pose have the same position error, so an exchange is nearly as likely; labels of different limbs differ by
// far more.
constexpr double kSwapMargin = 5.0;
// Cost up to which an assignment needs no comparison with its missing neighbours. Chosen by hand; not yet measured.
constexpr double kUnambiguousCost = 6.0;
// Margin over a missing neighbour: the prediction of a moving limb is overconfident (decision 0016).
constexpr double kNeighbourMargin = 24.0;
// Residual of the motion prediction from which on two labels may have exchanged their tracks. Chosen by hand; not yet
// measured.
constexpr double kSwapResidual_m = 0.008;

}  // namespace

TrackAssociation::TrackAssociation(std::size_t max_labels)
    : max_labels_(max_labels), assigner_(std::max<std::size_t>(max_labels, 1), kMaxMarkers, kMaxPairs) {
  pairs_.reserve(kMaxPairs);
  first_row_.reserve(kMaxSubjects);
  swap_suspects_.reserve(max_labels);
  first_pair_.reserve(max_labels + 1);
  row_of_.reserve(kMaxMarkers);
}

// Two labels whose sum of squared residuals is lower with exchanged tracks may have exchanged them. Both labels lose
// their acceptance and their continuity, and take part in the assignment like missing labels.
void TrackAssociation::distrust_swapped(std::vector<SubjectLabeller>& subjects, const LabelledTracks& tracks) {
  swap_suspects_.clear();
  for (std::size_t s = 0; s < subjects.size(); ++s) {
    if (!subjects[s].tracking()) continue;
    for (std::size_t m = 0; m < subjects[s].label_count(); ++m) {
      const auto off = subjects[s].marker_residual(m, tracks);
      if (off && (off->at - off->predicted).squaredNorm() > kSwapResidual_m * kSwapResidual_m)
        swap_suspects_.push_back({s, m, off->at, off->predicted});
    }
  }
  for (std::size_t i = 0; i < swap_suspects_.size(); ++i) {
    for (std::size_t j = i + 1; j < swap_suspects_.size(); ++j) {
      const SwapSuspect& a = swap_suspects_[i];
      const SwapSuspect& b = swap_suspects_[j];
      const double now = (a.at - a.predicted).squaredNorm() + (b.at - b.predicted).squaredNorm();
      const double exchanged = (a.at - b.predicted).squaredNorm() + (b.at - a.predicted).squaredNorm();
      if (exchanged + kSwapResidual_m * kSwapResidual_m >= now) continue;
      subjects[a.subject].distrust(a.marker);
      subjects[b.subject].distrust(b.marker);
    }
  }
}

// Whether no unassigned label has a similar cost for this track, and no unassigned track a similar cost for this label.
bool TrackAssociation::is_clear(const geometry::AllowedPair& candidate, std::span<const std::uint32_t> columns) const {
  return std::none_of(pairs_.begin(), pairs_.end(), [&](const geometry::AllowedPair& other) {
    if (other.cost > candidate.cost + kAssignmentMargin) return false;
    if (other.column == candidate.column && other.row != candidate.row)
      return columns[other.row] == geometry::Assigner::kUnassigned;
    if (other.row == candidate.row && other.column != candidate.column)
      return std::find(columns.begin(), columns.end(), other.column) == columns.end();
    return false;
  });
}

// Fills first_pair_ and row_of_.
void TrackAssociation::index_assignment(std::size_t rows, std::span<const std::uint32_t> columns) {
  first_pair_.assign(rows + 1, 0);
  row_of_.assign(kMaxMarkers, geometry::Assigner::kUnassigned);
  for (const geometry::AllowedPair& pair : pairs_) ++first_pair_[pair.row + 1];
  for (std::size_t row = 0; row < rows; ++row) {
    first_pair_[row + 1] += first_pair_[row];
    if (columns[row] != geometry::Assigner::kUnassigned) row_of_[columns[row]] = static_cast<std::uint32_t>(row);
  }
}

double TrackAssociation::cost_of(std::uint32_t row, std::uint32_t column) const {
  for (std::size_t i = first_pair_[row]; i < first_pair_[row + 1]; ++i) {
    if (pairs_[i].column == column) return pairs_[i].cost;
  }
  return std::numeric_limits<double>::infinity();
}

// Whether the exchange of tracks with another assigned label costs less than kSwapMargin more.
bool TrackAssociation::may_be_swapped(const geometry::AllowedPair& candidate,
                                      std::span<const std::uint32_t> columns) const {
  for (std::size_t i = first_pair_[candidate.row]; i < first_pair_[candidate.row + 1]; ++i) {
    const geometry::AllowedPair& alternative = pairs_[i];
    const std::uint32_t other =
        alternative.column == candidate.column ? geometry::Assigner::kUnassigned : row_of_[alternative.column];
    if (other == geometry::Assigner::kUnassigned) continue;
    const double now = candidate.cost + cost_of(other, columns[other]);
    if (alternative.cost + cost_of(other, candidate.column) < now + kSwapMargin) return true;
  }
  return false;
}

void TrackAssociation::associate(std::vector<SubjectLabeller>& subjects, LabelledTracks& tracks) {
  distrust_swapped(subjects, tracks);
  for (SubjectLabeller& subject : subjects) {
    if (subject.tracking()) subject.fit(tracks);
  }
  pairs_.clear();
  first_row_.clear();
  std::size_t rows = 0;
  for (SubjectLabeller& subject : subjects) {
    first_row_.push_back(rows);
    if (!subject.tracking()) continue;
    subject.build_costs(tracks, rows, kMaxPairs, pairs_);
    rows += subject.label_count();
  }
  if (pairs_.empty()) return;
  const auto columns = assigner_.assign(rows, tracks.labelled.size(), pairs_, kUnassignedCost);
  index_assignment(rows, columns);
  // All labels that lose their track release it before another label takes it.
  for (std::size_t s = 0; s < subjects.size(); ++s) {
    if (subjects[s].tracking() && subjects[s].participates())
      subjects[s].release_unassigned(columns.subspan(first_row_[s], subjects[s].label_count()), tracks);
  }
  for (const geometry::AllowedPair& pair : pairs_) {
    if (columns[pair.row] != pair.column) continue;
    const auto above = std::upper_bound(first_row_.begin(), first_row_.end(), pair.row);
    const auto s = static_cast<std::size_t>(above - first_row_.begin()) - 1;
    const std::size_t marker = pair.row - first_row_[s];
    const bool is_own = subjects[s].is_assigned_to(marker, pair.column);
    if (is_own && !subjects[s].discontinuous(marker)) continue;
    const bool is_unambiguous = is_clear(pair, columns) && !may_be_swapped(pair, columns);
    if (is_own && !is_unambiguous) subjects[s].release_label(marker, tracks);
    if (is_own || !is_unambiguous) continue;
    if (pair.cost > kUnambiguousCost &&
        subjects[s].may_be_neighbour(marker, pair.column, pair.cost + kNeighbourMargin, tracks))
      continue;
    if (!subjects[s].inside_gate(marker, pair.column, tracks) || subjects[s].is_ambiguous(marker, pair.column, tracks))
      continue;
    subjects[s].assign(marker, pair.column, tracks);
  }
}

}  // namespace mocap::label
