#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace mocap::geometry {

/// A row and a column that may be assigned to each other, with any finite cost.
struct AllowedPair {
  std::uint32_t row = 0;
  std::uint32_t column = 0;
  double cost = 0.0;
};

/// Finds the one-to-one assignment of rows to columns with the least sum of costs. Most pairs are not allowed (outside
/// of a gate), and a row may stay unassigned at a fixed cost.
///
/// The result is exact. Each row whose cheapest column is free starts with that column. The other rows are added one
/// after the other along shortest augmenting paths (Dijkstra's algorithm on reduced costs). Paths use allowed pairs
/// only, so that each connected component is solved separately. A row that became unassigned stays unassigned, because
/// further rows only increase the prices of columns. Equal costs are resolved by order, so that the same input gives
/// the same assignment.
///
/// Allocates in the constructor only. One thread at a time.
///
/// Source: Jonker and Volgenant, "A shortest augmenting path algorithm for dense and sparse linear assignment
/// problems", Computing 38 (1987), sections 3 and 4; "unassigned" is a private column of each row.
class Assigner {
 public:
  static constexpr std::uint32_t kUnassigned = 0xFFFF'FFFF;

  Assigner(std::size_t max_rows, std::size_t max_columns, std::size_t max_pairs);

  /// Returns the column of each row, or kUnassigned for an unassigned row. The result is valid until the next call.
  /// Preconditions: the sizes are at most those of the constructor; the row of each pair is below `rows`, its column
  /// below `columns`. A pair that costs `cost_of_unassigned` or more is never assigned.
  std::span<const std::uint32_t> assign(std::size_t rows, std::size_t columns, std::span<const AllowedPair> pairs,
                                        double cost_of_unassigned);

 private:
  struct Edge {
    std::uint32_t column;
    double cost;
  };
  struct Reached {
    double distance;
    std::uint32_t column;
  };
  struct End {
    double distance;
    std::uint32_t row;
    std::uint32_t column;  // kUnassigned: the row becomes unassigned
  };

  void sort_by_row(std::size_t rows, std::size_t columns, std::span<const AllowedPair> pairs,
                   double cost_of_unassigned);
  void augment(std::uint32_t start, double cost_of_unassigned);
  End shortest_path(std::uint32_t start, double cost_of_unassigned);
  void relax(std::uint32_t row, double distance, double limit);

  std::size_t max_rows_, max_columns_, max_pairs_;
  std::vector<std::uint32_t> first_edge_;  // by row: index of its first edge; one more element at the end
  std::vector<Edge> edges_;
  std::vector<std::uint32_t> column_of_row_, row_of_column_;
  std::vector<double> row_price_, column_price_;
  std::vector<double> distance_;             // by column: length of the shortest path from the row that is added
  std::vector<std::uint32_t> reached_from_;  // by column: the previous row on that path
  std::vector<std::uint8_t> done_;
  std::vector<std::uint32_t> touched_;  // columns whose distance_ and done_ must be reset after the search
  std::vector<Reached> heap_;
};

}  // namespace mocap::geometry
