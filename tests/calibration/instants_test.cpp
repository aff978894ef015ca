#include "calibration/wand/instants.h"

#include <gtest/gtest.h>

namespace mocap::calibration {
namespace instants_test {

using std::chrono::microseconds;
using std::chrono::milliseconds;

Timestamp at(Duration since_start) { return from_ns(0) + since_start; }

TEST(Instants, TheFramePeriodIsTheMedianOfTheCameraWithTheMostImages) {
  Take recording;
  recording.cameras.resize(2);
  for (const int ms : {0, 10, 20, 50, 60}) recording.cameras[0].push_back({at(milliseconds(ms)), {}});
  recording.cameras[1].push_back({at(milliseconds(3)), {}});

  EXPECT_EQ(frame_period(recording), milliseconds(10));
  EXPECT_EQ(frame_period({}), Duration{0});
}

TEST(Instants, GroupsImagesWithinTheSkewOfTheFirst) {
  Take recording;
  recording.cameras.resize(3);
  for (const int ms : {0, 20, 40}) recording.cameras[0].push_back({at(milliseconds(ms)), {}});
  recording.cameras[1].push_back({at(milliseconds(3)), {}});   // joins the first instant
  recording.cameras[2].push_back({at(milliseconds(26)), {}});  // 6 ms after the second: a separate instant

  const auto instants = group_by_instant(recording, milliseconds(5));

  ASSERT_EQ(instants.size(), 4u);
  EXPECT_EQ(instants[0].image, (std::vector<int>{0, 0, -1}));
  EXPECT_EQ(instants[1].image, (std::vector<int>{1, -1, -1}));
  EXPECT_EQ(instants[2].image, (std::vector<int>{-1, -1, 0}));
  EXPECT_EQ(instants[2].at, at(milliseconds(26)));
}

TEST(Instants, TwoImagesOfOneCameraAreTwoInstants) {
  Take recording;
  recording.cameras.resize(1);
  for (const int us : {0, 100, 200}) recording.cameras[0].push_back({at(microseconds(us)), {}});

  EXPECT_EQ(group_by_instant(recording, milliseconds(5)).size(), 3u);
}

}  // namespace instants_test
}  // namespace mocap::calibration
