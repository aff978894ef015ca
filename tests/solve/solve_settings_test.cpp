#include "solve/solve_settings.h"

#include <gtest/gtest.h>

#include "base/key_check.h"

namespace mocap::solve {
namespace solve_settings_test {

TEST(SolveSettings, HaveDefaultsWithinTheirRanges) {
  const SolveSettings defaults;

  EXPECT_TRUE(check_keys(defaults).empty());
}

TEST(SolveSettings, CheckTheSmoothingToo) {
  SolveSettings solve;
  solve.smoothing.beta = -1.0;

  ASSERT_EQ(check_keys(solve).size(), 1U);
  EXPECT_EQ(check_keys(solve)[0].key, "smoothing_beta");
}

}  // namespace solve_settings_test
}  // namespace mocap::solve
