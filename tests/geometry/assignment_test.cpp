#include "geometry/assignment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace mocap::geometry {
namespace assignment_test {

using Columns = std::vector<std::uint32_t>;

/// The smallest sum of costs over all assignments, by brute force.
double cheapest(std::size_t rows, std::size_t columns, const std::vector<AllowedPair>& pairs, double unassigned_cost,
                std::size_t row = 0, std::uint32_t taken = 0) {
  if (row == rows) return 0.0;
  double best = unassigned_cost + cheapest(rows, columns, pairs, unassigned_cost, row + 1, taken);
  for (const AllowedPair& pair : pairs) {
    if (pair.row != row || ((taken >> pair.column) & 1U) != 0) continue;
    best = std::min(best,
                    pair.cost + cheapest(rows, columns, pairs, unassigned_cost, row + 1, taken | (1U << pair.column)));
  }
  return best;
}

/// The sum of costs of an assignment; infinite if a pair is not allowed. Fails if a column is assigned twice.
double cost_of(std::span<const std::uint32_t> assigned, const std::vector<AllowedPair>& pairs, double unassigned_cost) {
  double sum = 0.0;
  Columns used_columns;
  for (std::uint32_t row = 0; row < assigned.size(); ++row) {
    if (assigned[row] == Assigner::kUnassigned) {
      sum += unassigned_cost;
      continue;
    }
    EXPECT_EQ(std::count(used_columns.begin(), used_columns.end(), assigned[row]), 0) << "column assigned twice";
    used_columns.push_back(assigned[row]);
    double pair_cost = std::numeric_limits<double>::infinity();
    for (const AllowedPair& pair : pairs) {
      if (pair.row == row && pair.column == assigned[row]) pair_cost = std::min(pair_cost, pair.cost);
    }
    sum += pair_cost;
  }
  return sum;
}

std::vector<AllowedPair> random_pairs(std::mt19937& random, std::uint32_t rows, std::uint32_t columns, double density,
                                      bool whole_costs) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  std::vector<AllowedPair> pairs;
  for (std::uint32_t row = 0; row < rows; ++row) {
    for (std::uint32_t column = 0; column < columns; ++column) {
      if (unit(random) > density) continue;
      const double cost = 12.0 * unit(random) - 4.0;
      pairs.push_back({row, column, whole_costs ? std::floor(cost) : cost});
    }
  }
  std::shuffle(pairs.begin(), pairs.end(), random);
  return pairs;
}

TEST(Assigner, FindsTheCheapestOfAllAssignmentsOnSmallCases) {
  std::mt19937 random(7);
  Assigner assigner(7, 7, 49);
  for (int trial = 0; trial < 3000; ++trial) {
    const auto rows = static_cast<std::uint32_t>(random() % 7 + 1);
    const auto columns = static_cast<std::uint32_t>(random() % 7 + 1);
    const double density = 0.15 + 0.2 * static_cast<double>(trial % 5);
    const double unassigned_cost = static_cast<double>(trial % 4) * 3.0 - 1.0;
    const std::vector<AllowedPair> pairs = random_pairs(random, rows, columns, density, trial % 2 == 0);

    const auto assigned = assigner.assign(rows, columns, pairs, unassigned_cost);

    ASSERT_EQ(assigned.size(), rows);
    ASSERT_NEAR(cost_of(assigned, pairs, unassigned_cost), cheapest(rows, columns, pairs, unassigned_cost), 1e-9)
        << "trial " << trial;
  }
}

TEST(Assigner, PrefersTheLeastSumToTheCheapestPair) {
  Assigner assigner(2, 2, 4);
  const std::vector<AllowedPair> pairs{{0, 0, 1.0}, {0, 1, 2.0}, {1, 0, 1.5}};

  const auto assigned = assigner.assign(2, 2, pairs, 10.0);

  EXPECT_EQ(Columns(assigned.begin(), assigned.end()), (Columns{1, 0}));
}

TEST(Assigner, LeavesARowUnassignedIfItsPairCostsAtLeastAsMuch) {
  Assigner assigner(1, 1, 1);

  EXPECT_EQ(assigner.assign(1, 1, std::vector<AllowedPair>{{0, 0, 4.0}}, 4.0)[0], Assigner::kUnassigned);
  EXPECT_EQ(assigner.assign(1, 1, std::vector<AllowedPair>{{0, 0, 3.9}}, 4.0)[0], 0U);
}

TEST(Assigner, AcceptsNoRowsAndNoColumns) {
  Assigner assigner(3, 3, 9);

  EXPECT_TRUE(assigner.assign(0, 3, {}, 1.0).empty());
  const auto assigned = assigner.assign(3, 0, {}, 1.0);

  EXPECT_EQ(Columns(assigned.begin(), assigned.end()), (Columns(3, Assigner::kUnassigned)));
}

TEST(Assigner, FindsTheIdentityAmongAHundredCrowdedRows) {
  // Points on a line at distances of 1, each displaced by 0.2. The identity has the least sum of squared distances,
  // because a convex cost never favours a change of the order on a line.
  std::vector<AllowedPair> pairs;
  for (std::uint32_t row = 0; row < 100; ++row) {
    for (std::uint32_t column = 0; column < 100; ++column) {
      const double apart = static_cast<double>(row) + 0.2 - static_cast<double>(column);
      if (std::abs(apart) < 8.0) pairs.push_back({row, column, apart * apart});
    }
  }
  Assigner assigner(100, 100, pairs.size());

  const auto assigned = assigner.assign(100, 100, pairs, 64.0);

  for (std::uint32_t row = 0; row < 100; ++row) EXPECT_EQ(assigned[row], row);
}

}  // namespace assignment_test
}  // namespace mocap::geometry
