#include "calibration/floor/walk_positions.h"

#include <gtest/gtest.h>

namespace mocap::calibration {
namespace walk_positions_test {

TEST(WalkPositions, AreKeptEvenlyOverALongWalk) {
  WalkPositions walk;
  for (int i = 0; i < 150000; ++i) walk.add({0.001 * i, 0.0, 0.0}, 3);

  const auto& kept = walk.positions();

  ASSERT_GT(kept.size(), 10000u);
  ASSERT_LE(kept.size(), 20000u);
  for (std::size_t i = 1; i < kept.size(); ++i) ASSERT_NEAR(kept[i].x() - kept[i - 1].x(), 0.008, 1e-9) << i;
}

TEST(WalkPositions, LeaveOutWhatTwoCamerasSee) {
  WalkPositions walk;
  walk.add({1.0, 0.0, 0.0}, 2);
  walk.add({2.0, 0.0, 0.0}, 3);

  ASSERT_EQ(walk.positions().size(), 1u);
  EXPECT_EQ(walk.positions()[0].x(), 2.0);
}

}  // namespace walk_positions_test
}  // namespace mocap::calibration
