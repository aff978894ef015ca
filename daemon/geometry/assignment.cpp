#include "geometry/assignment.h"

#include <algorithm>
#include <limits>

#include "base/expects.h"

namespace mocap::geometry {
namespace {

constexpr double kFar = std::numeric_limits<double>::infinity();

constexpr auto kNearestOnTop = [](const auto& a, const auto& b) {
  return a.distance != b.distance ? a.distance > b.distance : a.column > b.column;
};

}  // namespace

Assigner::Assigner(std::size_t max_rows, std::size_t max_columns, std::size_t max_pairs)
    : max_rows_(max_rows), max_columns_(max_columns), max_pairs_(max_pairs) {
  first_edge_.reserve(max_rows + 2);
  edges_.reserve(max_pairs);
  column_of_row_.reserve(max_rows);
  row_price_.reserve(max_rows);
  row_of_column_.reserve(max_columns);
  column_price_.reserve(max_columns);
  distance_.assign(max_columns, kFar);
  reached_from_.resize(max_columns);
  done_.assign(max_columns, 0);
  touched_.reserve(max_columns);
  heap_.reserve(max_pairs + 1);  // a path search pushes each pair at most once
}

std::span<const std::uint32_t> Assigner::assign(std::size_t rows, std::size_t columns,
                                                std::span<const AllowedPair> pairs, double cost_of_unassigned) {
  MOCAP_EXPECTS(rows <= max_rows_ && columns <= max_columns_ && pairs.size() <= max_pairs_);
  sort_by_row(rows, columns, pairs, cost_of_unassigned);
  column_of_row_.assign(rows, kUnassigned);
  row_of_column_.assign(columns, kUnassigned);
  column_price_.assign(columns, 0.0);
  row_price_.assign(rows, cost_of_unassigned);
  // Initial assignment: each row gets its cheapest column if that column is still free. All column prices are still 0,
  // so these pairs have reduced cost 0.
  for (std::uint32_t row = 0; row < rows; ++row) {
    std::uint32_t cheapest = kUnassigned;
    for (std::uint32_t e = first_edge_[row]; e < first_edge_[row + 1]; ++e) {
      if (edges_[e].cost >= row_price_[row]) continue;
      row_price_[row] = edges_[e].cost;
      cheapest = edges_[e].column;
    }
    if (cheapest == kUnassigned || row_of_column_[cheapest] != kUnassigned) continue;
    column_of_row_[row] = cheapest;
    row_of_column_[cheapest] = row;
  }
  for (std::uint32_t row = 0; row < rows; ++row) {
    if (column_of_row_[row] == kUnassigned && first_edge_[row] < first_edge_[row + 1]) augment(row, cost_of_unassigned);
  }
  return column_of_row_;
}

void Assigner::sort_by_row(std::size_t rows, std::size_t columns, std::span<const AllowedPair> pairs,
                           double cost_of_unassigned) {
  // Counting sort. Element row + 2 counts the edges of a row. After the prefix sums, element row + 1 is the position of
  // the row's next edge; after all edges are stored, element row is the position of the row's first edge.
  first_edge_.assign(rows + 2, 0);
  for (const AllowedPair& pair : pairs) {
    MOCAP_EXPECTS(pair.row < rows && pair.column < columns);
    if (pair.cost < cost_of_unassigned) ++first_edge_[pair.row + 2];
  }
  for (std::size_t i = 1; i < first_edge_.size(); ++i) first_edge_[i] += first_edge_[i - 1];
  edges_.resize(first_edge_.back());
  for (const AllowedPair& pair : pairs) {
    if (pair.cost < cost_of_unassigned) edges_[first_edge_[pair.row + 1]++] = {pair.column, pair.cost};
  }
}

void Assigner::augment(std::uint32_t start, double cost_of_unassigned) {
  const End end = shortest_path(start, cost_of_unassigned);

  // The price of a settled column changes by the difference between its distance and that of the end of the path, so
  // that all reduced costs stay at least 0.
  row_price_[start] += end.distance;
  for (const std::uint32_t column : touched_) {
    if (done_[column] != 0) {
      const double nearer = end.distance - distance_[column];
      column_price_[column] -= nearer;
      row_price_[row_of_column_[column]] += nearer;
    }
    distance_[column] = kFar;
    done_[column] = 0;
  }
  touched_.clear();

  // Each column on the path moves to the previous row of the path. The last row gets the free column or stays
  // unassigned.
  std::uint32_t column = end.column;
  std::uint32_t row = end.row;
  while (true) {
    const std::uint32_t given_up = column_of_row_[row];
    column_of_row_[row] = column;
    if (column != kUnassigned) row_of_column_[column] = row;
    if (row == start) return;
    column = given_up;
    row = reached_from_[column];
  }
}

Assigner::End Assigner::shortest_path(std::uint32_t start, double cost_of_unassigned) {
  heap_.clear();
  End unassigned{cost_of_unassigned - row_price_[start], start, kUnassigned};
  relax(start, 0.0, unassigned.distance);
  while (!heap_.empty()) {
    const Reached top = heap_.front();
    if (top.distance >= unassigned.distance) break;
    std::pop_heap(heap_.begin(), heap_.end(), kNearestOnTop);
    heap_.pop_back();
    if (done_[top.column] != 0 || top.distance > distance_[top.column]) continue;
    const std::uint32_t owner = row_of_column_[top.column];
    if (owner == kUnassigned) return {top.distance, reached_from_[top.column], top.column};
    done_[top.column] = 1;
    const double owner_unassigned = top.distance + cost_of_unassigned - row_price_[owner];
    if (owner_unassigned < unassigned.distance) unassigned = {owner_unassigned, owner, kUnassigned};
    relax(owner, top.distance, unassigned.distance);
  }
  return unassigned;
}

void Assigner::relax(std::uint32_t row, double distance, double limit) {
  for (std::uint32_t e = first_edge_[row]; e < first_edge_[row + 1]; ++e) {
    const Edge& edge = edges_[e];
    const double further = distance + std::max(0.0, edge.cost - row_price_[row] - column_price_[edge.column]);
    if (further >= limit || done_[edge.column] != 0 || further >= distance_[edge.column]) continue;
    if (distance_[edge.column] == kFar) touched_.push_back(edge.column);
    distance_[edge.column] = further;
    reached_from_[edge.column] = row;
    heap_.push_back({further, edge.column});
    std::push_heap(heap_.begin(), heap_.end(), kNearestOnTop);
  }
}

}  // namespace mocap::geometry
