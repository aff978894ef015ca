#include "track2d/assignment_ambiguity.h"

#include <gtest/gtest.h>

#include <vector>

namespace mocap::track2d {
namespace assignment_ambiguity_test {

constexpr std::uint32_t kUnassigned = geometry::Assigner::kUnassigned;
constexpr double kUnassignedCost = 33.0, kMargin = 6.0;

std::vector<bool> ambiguous(const std::vector<geometry::AllowedPair>& pairs,
                            const std::vector<std::uint32_t>& columns) {
  AssignmentAmbiguity ambiguity(8, 8);
  const auto found = ambiguity.find(pairs, columns, 8, kUnassignedCost, kMargin);
  return {found.begin(), found.end()};
}

TEST(AssignmentAmbiguity, IsAnExchangeOfTwoRowsThatCostsLessThanTheMargin) {
  const auto exchange = [](double cost) {
    return ambiguous({{0, 0, 1.0}, {0, 1, 1.0 + cost / 2}, {1, 1, 2.0}, {1, 0, 2.0 + cost / 2}}, {0, 1});
  };

  EXPECT_EQ(exchange(5.9), (std::vector<bool>{true, true}));
  EXPECT_EQ(exchange(6.1), (std::vector<bool>{false, false}));
}

TEST(AssignmentAmbiguity, IsAFreeColumnNearlyAsGood) {
  EXPECT_EQ(ambiguous({{0, 0, 1.0}, {0, 3, 4.0}}, {0}), std::vector<bool>{true});
  EXPECT_EQ(ambiguous({{0, 0, 1.0}, {0, 3, 8.0}}, {0}), std::vector<bool>{false});
}

// Each of three rows may have the next column: no exchange of two is cheap, the rotation of all three is.
TEST(AssignmentAmbiguity, IsARotationOfThreeRows) {
  EXPECT_EQ(ambiguous({{0, 0, 1.0}, {0, 1, 2.0}, {1, 1, 1.0}, {1, 2, 2.0}, {2, 2, 1.0}, {2, 0, 2.0}}, {0, 1, 2}),
            (std::vector<bool>{true, true, true}));
}

TEST(AssignmentAmbiguity, IsNotForARowWithoutAnotherColumnNorForOneWithoutAny) {
  EXPECT_EQ(ambiguous({{0, 0, 1.0}, {1, 5, 3.0}}, {0, kUnassigned}), (std::vector<bool>{false, false}));
}

// The row that would lose the column has nothing else: it would stay unassigned.
TEST(AssignmentAmbiguity, CountsWhatTheLosingRowPays) {
  EXPECT_EQ(ambiguous({{0, 0, 1.0}, {0, 1, 2.0}, {1, 1, 1.0}}, {0, 1}), (std::vector<bool>{false, false}));
}

}  // namespace assignment_ambiguity_test
}  // namespace mocap::track2d
