#include "track2d/assignment_ambiguity.h"

#include <algorithm>

namespace mocap::track2d {
namespace {

constexpr std::uint32_t kUnassigned = geometry::Assigner::kUnassigned;

}  // namespace

AssignmentAmbiguity::AssignmentAmbiguity(std::size_t max_rows, std::size_t max_columns) {
  costs_.reserve(max_rows);
  rows_.reserve(max_columns);
  ambiguous_.reserve(max_rows);
}

std::span<const char> AssignmentAmbiguity::find(std::span<const geometry::AllowedPair> pairs,
                                                std::span<const std::uint32_t> columns, std::size_t column_count,
                                                double unassigned_cost, double margin) {
  costs_.assign(columns.size(), Costs{unassigned_cost, unassigned_cost});
  ambiguous_.assign(columns.size(), 0);
  rows_.assign(column_count, kUnassigned);
  for (std::uint32_t row = 0; row < columns.size(); ++row) {
    if (columns[row] != kUnassigned) rows_[columns[row]] = row;
  }
  for (const geometry::AllowedPair& pair : pairs) {
    Costs& costs = costs_[pair.row];
    double& least = columns[pair.row] == pair.column ? costs.assigned : costs.second;
    least = std::min(least, pair.cost);
  }
  for (const geometry::AllowedPair& pair : pairs) {
    if (columns[pair.row] == kUnassigned || columns[pair.row] == pair.column) continue;
    const std::uint32_t loser = rows_[pair.column];
    const double of_loser = loser == kUnassigned ? 0.0 : costs_[loser].second - costs_[loser].assigned;
    if (pair.cost - costs_[pair.row].assigned + of_loser >= margin) continue;
    ambiguous_[pair.row] = 1;
    if (loser != kUnassigned) ambiguous_[loser] = 1;
  }
  return ambiguous_;
}

}  // namespace mocap::track2d
