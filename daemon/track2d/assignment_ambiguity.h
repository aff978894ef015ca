#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "geometry/assignment.h"

namespace mocap::track2d {

/// Finds the rows of an assignment that have a nearly as good alternative: the row takes another column, and the row
/// that loses this column takes its own second best. The second best may be assigned too, so the alternative may cost
/// more than found here: a row that is not ambiguous has a clear column (decision 0003).
///
/// Thread: one. Allocates in the constructor only.
class AssignmentAmbiguity {
 public:
  AssignmentAmbiguity(std::size_t max_rows, std::size_t max_columns);

  /// For each row, whether it has an alternative that costs less than `margin` more, or loses its column in one.
  /// `columns`: the assigned column of each row, or Assigner::kUnassigned. Valid until the next call. Linear in the
  /// pairs.
  std::span<const char> find(std::span<const geometry::AllowedPair> pairs, std::span<const std::uint32_t> columns,
                             std::size_t column_count, double unassigned_cost, double margin);

 private:
  // Costs of a row: of its column, and the least of all other columns.
  struct Costs {
    double assigned, second;
  };

  std::vector<Costs> costs_;         // by row
  std::vector<std::uint32_t> rows_;  // by column: the row to which it is assigned, or kUnassigned
  std::vector<char> ambiguous_;      // by row
};

}  // namespace mocap::track2d
