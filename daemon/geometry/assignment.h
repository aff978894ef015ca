#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace mocap::geometry {

/// A row and a column that may go together, and what that costs. Any finite cost.
struct AllowedPair {
  std::uint32_t row = 0;
  std::uint32_t column = 0;
  double cost = 0.0;
};

/// Finds the cheapest one-to-one assignment of rows to columns, where most pairs are not allowed (they lie outside of a
/// gate) and a row may stay alone at a price.
///
/// Exact: no other assignment has a smaller sum of costs. Rows are added one after the other by shortest augmenting
/// paths (Dijkstra on reduced costs); a path runs along allowed pairs only, so that each connected component is solved
/// by itself; a row whose cheapest column is still free begins with it. A row that was displaced to stay alone stays
/// so: further rows only make columns dearer. Ties are broken by order, so that the same input gives the same
/// assignment.
///
/// All memory is taken in the constructor. One thread at a time.
///
/// Source: Jonker and Volgenant, "A shortest augmenting path algorithm for dense and sparse linear assignment
/// problems", Computing 38 (1987), sections 3 and 4; alone is a private column of each row.
class Assigner {
 public:
  static constexpr std::uint32_t kAlone = 0xFFFF'FFFF;

  Assigner(std::size_t max_rows, std::size_t max_columns, std::size_t max_pairs);

  /// The column of each row, or kAlone. At most the sizes given to the constructor; each pair's row is below `rows` and
  /// its column below `columns`. A pair that costs as much as `cost_of_alone` or more is never taken. The result is
  /// borrowed until the next call.
  std::span<const std::uint32_t> assign(std::size_t rows, std::size_t columns, std::span<const AllowedPair> pairs,
                                        double cost_of_alone);

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
    std::uint32_t column;  // kAlone: the row stays alone
  };

  void sort_by_row(std::size_t rows, std::size_t columns, std::span<const AllowedPair> pairs, double cost_of_alone);
  void augment(std::uint32_t start, double cost_of_alone);
  End shortest_path(std::uint32_t start, double cost_of_alone);
  void relax(std::uint32_t row, double distance, double limit);

  std::size_t max_rows_, max_columns_, max_pairs_;
  std::vector<std::uint32_t> first_edge_;  // of each row; one more at the end
  std::vector<Edge> edges_;
  std::vector<std::uint32_t> column_of_row_, row_of_column_;
  std::vector<double> row_price_, column_price_;
  std::vector<double> distance_;             // of each column from the row that is being added
  std::vector<std::uint32_t> reached_from_;  // the row before each column on its path
  std::vector<std::uint8_t> done_;
  std::vector<std::uint32_t> touched_;  // columns whose distance_ and done_ must be reset
  std::vector<Reached> heap_;
};

}  // namespace mocap::geometry
