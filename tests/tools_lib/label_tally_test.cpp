#include "lib/benchmark/label_tally.h"

#include <gtest/gtest.h>

#include <vector>

namespace mocap::benchmark {
namespace label_tally_test {

constexpr int kNull = LabelTally::kNull;

TEST(LabelTally, CountsAWorkedExample) {
  LabelTally tally(2, 10.0);
  tally.add(std::vector{0, 1, kNull}, std::vector{kNull, kNull, kNull});
  tally.add(std::vector{0, 1, kNull}, std::vector{0, kNull, 1});

  const LabelFigures figures = tally.figures();

  // Marker 0: 1 right of 1 given and 2 true, F1 2/3. Marker 1: 0 right of 1 and 2, F1 0. Null: 1 right of 4 and 2, F1
  // 1/3.
  EXPECT_NEAR(*figures.macro_f1, (2.0 / 3.0 + 0.0 + 1.0 / 3.0) / 3.0, 1e-12);
  EXPECT_NEAR(*figures.macro_precision, (1.0 + 0.0 + 0.25) / 3.0, 1e-12);
  EXPECT_NEAR(*figures.macro_recall, (0.5 + 0.0 + 0.5) / 3.0, 1e-12);
  EXPECT_NEAR(*figures.accuracy, 2.0 / 6.0, 1e-12);
  EXPECT_NEAR(*figures.label_precision, 0.5, 1e-12);
  EXPECT_NEAR(*figures.label_recall, 0.25, 1e-12);
  EXPECT_NEAR(*figures.idf1, 2.0 * 1.0 / 6.0, 1e-12);  // 1 common of 4 true and 2 given
  EXPECT_EQ(figures.wrong, 1U);
  EXPECT_EQ(figures.longest_wrong_frames, 1U);
  EXPECT_NEAR(*figures.first_label_s, 0.1, 1e-12);
}

TEST(LabelTally, DoesNotCountAPointOfUnknownTruth) {
  LabelTally tally(2, 10.0);
  tally.add(std::vector{LabelTally::kUnknown, 1, LabelTally::kUnknown}, std::vector{0, 1, kNull});

  const LabelFigures figures = tally.figures();

  EXPECT_EQ(figures.points, 1U);
  EXPECT_EQ(figures.unknown_points, 2U);
  EXPECT_EQ(figures.wrong, 0U);
  EXPECT_EQ(figures.longest_wrong_frames, 0U);
  EXPECT_NEAR(*figures.accuracy, 1.0, 1e-12);
}

TEST(LabelTally, LongestWrongIsARunOfOneLabel) {
  LabelTally tally(2, 10.0);
  tally.add(std::vector{0, 1}, std::vector{1, 0});
  tally.add(std::vector{0, 1}, std::vector{0, 1});
  tally.add(std::vector{0, 1}, std::vector{kNull, 0});
  tally.add(std::vector{0, 1}, std::vector{1, 0});

  EXPECT_EQ(tally.figures().longest_wrong_frames, 2U);  // of label 0, in the last two frames
}

TEST(LabelTally, TwoMarkersThatMostlyExchangeTheirLabelsKeepTheirIdentity) {
  LabelTally tally(2, 10.0);
  for (int frame = 0; frame < 9; ++frame) tally.add(std::vector{0, 1}, std::vector{1, 0});
  tally.add(std::vector{0, 1}, std::vector{0, 1});

  EXPECT_NEAR(*tally.figures().macro_f1, 0.1, 1e-12);
  EXPECT_NEAR(*tally.figures().idf1, 0.9, 1e-12);
}

TEST(LabelTally, ListsWrongLabelsMostFrequentFirst) {
  LabelTally tally(2, 10.0);
  tally.add(std::vector{0, 1, kNull}, std::vector{kNull, 0, 1});
  tally.add(std::vector{0, 1, kNull}, std::vector{0, kNull, 1});

  const std::vector<Confusion> wrong = tally.confusions();

  ASSERT_EQ(wrong.size(), 2U);
  EXPECT_EQ(wrong[0].given, 1);
  EXPECT_EQ(wrong[0].truth, kNull);
  EXPECT_EQ(wrong[0].points, 2U);
  EXPECT_EQ(wrong[1].given, 0);
  EXPECT_EQ(wrong[1].truth, 1);
}

TEST(LabelTally, WithoutPointsNoFigureIsThere) {
  const LabelTally tally(2, 10.0);

  EXPECT_FALSE(tally.figures().macro_f1);
  EXPECT_FALSE(tally.figures().accuracy);
  EXPECT_FALSE(tally.figures().idf1);
  EXPECT_FALSE(tally.figures().first_label_s);
}

}  // namespace label_tally_test
}  // namespace mocap::benchmark
