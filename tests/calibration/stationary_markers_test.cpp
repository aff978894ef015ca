#include "calibration/floor/stationary_markers.h"

#include <gtest/gtest.h>

namespace mocap::calibration {
namespace stationary_markers_test {

constexpr Duration kPeriod = std::chrono::milliseconds(10);
const Eigen::Vector3d kPlace{1.0, 2.0, 3.0};

TEST(StationaryMarkers, AreThoseThatStayForHalfOfTheInstants) {
  StationaryMarkers markers;
  for (int i = 0; i < 300; ++i) {
    markers.begin(Timestamp{i * kPeriod});
    markers.add(TrackId{1}, kPlace + Eigen::Vector3d(i % 2 == 0 ? 0.001 : -0.001, 0.0, 0.0));
    markers.add(TrackId{2}, kPlace + i * Eigen::Vector3d(0.0001, 0.0, 0.0));
    if (i < 120) markers.add(TrackId{3}, kPlace);
  }

  const auto found = markers.positions();

  ASSERT_EQ(found.size(), 1u) << "track 2 moves, track 3 is seen too seldom";
  EXPECT_LT((found[0] - kPlace).norm(), 1e-9);
}

TEST(StationaryMarkers, NeedASecond) {
  StationaryMarkers markers;
  for (int i = 0; i < 90; ++i) {
    markers.begin(Timestamp{i * kPeriod});
    markers.add(TrackId{1}, kPlace);
  }

  EXPECT_TRUE(markers.positions().empty());
}

TEST(StationaryMarkers, KeepABoundedNumberOfTracks) {
  StationaryMarkers markers;
  for (int i = 0; i < 200; ++i) {
    markers.begin(Timestamp{i * kPeriod});
    markers.add(TrackId{0}, kPlace);
    for (std::uint32_t m = 1; m < 100; ++m) markers.add(TrackId{i * 100 + m}, kPlace);
  }

  EXPECT_EQ(markers.positions().size(), 1u);
}

}  // namespace stationary_markers_test
}  // namespace mocap::calibration
