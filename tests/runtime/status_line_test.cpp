#include "runtime/report/status_line.h"

#include <gmock/gmock.h>

namespace mocap::runtime {
namespace status_line_test {

TEST(StatusLine, CoversTheLastTwoSecondsNotTheWholeRun) {
  const RunTotals before{{1000, 1000, 400}, 1000, 900, 990, 3, {}};
  const RunTotals now{{1120, 1120, 400}, 1120, 1014, 1110, 5, {}};

  EXPECT_EQ(status_line(before, now, std::chrono::seconds(2)),
            "cameras=2 of 3 sets=60.0/s complete=95.0% sent=60.0/s dropped=5");
}

TEST(StatusLine, NamesARecordingThatFailed) {
  const RunTotals failed{{7}, 7, 7, 7, 0, {"takes/a.jsonl"}};

  EXPECT_EQ(status_line(failed, failed, std::chrono::seconds(1)),
            "cameras=0 of 1 sets=0.0/s complete=0.0% sent=0.0/s dropped=0 recording 'takes/a.jsonl' failed");
}

TEST(StatusLine, NamesACameraThatContributesNothing) {
  const RunTotals before{{0, 0, 0}, 0, 0, 0, 0, {}, {"a", "b", "c"}, {{1000, 900}, {1000, 900}, {1000, 900}}};
  const RunTotals now{
      {120, 120, 120}, 120, 120, 120, 0, {}, {"a", "b", "c"}, {{3000, 2700}, {3000, 920}, {3000, 2900}}};

  EXPECT_THAT(status_line(before, now, std::chrono::seconds(2)),
              ::testing::EndsWith(
                  "dropped=0 camera 'b': 1 % of its blobs are in 3D markers, 95 % of those of the other "
                  "cameras; for the cause: mocapctl capture stop; mocap-calibrate verify --config FILE; mocapctl "
                  "capture start"));
}

TEST(StatusLine, ShowsZeroWithoutImages) {
  const RunTotals still{{7}, 7, 7, 7, 0, {}};

  EXPECT_EQ(status_line(still, still, std::chrono::seconds(1)),
            "cameras=0 of 1 sets=0.0/s complete=0.0% sent=0.0/s dropped=0");
}

}  // namespace status_line_test
}  // namespace mocap::runtime
