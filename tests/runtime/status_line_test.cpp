#include "runtime/status_line.h"

#include <gtest/gtest.h>

namespace mocap::runtime {
namespace {

TEST(StatusLine, TellsTheLastTwoSecondsAndNotTheWholeRun) {
  const RunTotals before{{1000, 1000, 400}, 1000, 900, 990, 3};
  const RunTotals now{{1120, 1120, 400}, 1120, 1014, 1110, 5};

  EXPECT_EQ(status_line(before, now, std::chrono::seconds(2)),
            "cameras=2 of 3 sets=60.0/s complete=95.0% sent=60.0/s dropped=5");
}

TEST(StatusLine, SaysZeroWhileNothingComes) {
  const RunTotals still{{7}, 7, 7, 7, 0};

  EXPECT_EQ(status_line(still, still, std::chrono::seconds(1)),
            "cameras=0 of 1 sets=0.0/s complete=0.0% sent=0.0/s dropped=0");
}

}  // namespace
}  // namespace mocap::runtime
