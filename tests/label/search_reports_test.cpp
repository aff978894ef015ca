#include "label/search_reports.h"

#include <gtest/gtest.h>

#include "label/test_tracks.h"

namespace mocap::label {
namespace search_reports_test {

constexpr Timestamp kStart = from_ns(1'000'000'000);
constexpr Duration kStep = std::chrono::milliseconds(500);
constexpr SubjectId kAnna{0};

TEST(SearchReports, AreDueEverySecondAfterAFirstSecond) {
  SearchReports reports(std::chrono::milliseconds(400));

  std::string due;
  for (int set = 0; set < 6; ++set) due += reports.due(kAnna, kStart + set * kStep) ? '1' : '0';

  EXPECT_EQ(due, "001010");
}

TEST(SearchReports, WaitAnotherSecondAfterTheSubjectWasFound) {
  SearchReports reports(std::chrono::milliseconds(400));
  (void)reports.due(kAnna, kStart);
  reports.found(kAnna);

  EXPECT_FALSE(reports.due(kAnna, kStart + 2 * kStep));
  EXPECT_TRUE(reports.due(kAnna, kStart + 4 * kStep));
}

TEST(SearchReports, HaveTheUnlabelledTracksAndThoseThatStandStill) {
  TrackedMarkers tracked;
  tracked.push_back(test::detected_track(1, {0.0, 0.0, 1.0}));
  tracked.push_back(test::detected_track(2, {1.0, 0.0, 1.0}));
  tracked.push_back(test::detected_track(3, {2.0, 0.0, 1.0}));
  tracked.push_back(test::detected_track(4, {3.0, 0.0, 1.0}));
  tracked[3].state = TrackState::Candidate;
  StationaryTracks stationary(0.02);
  stationary.update(tracked, kStart);
  tracked[1].position.v.x() = 1.5;
  stationary.update(tracked, kStart + kStep);
  LabelledTracks tracks;
  test::update(tracks, tracked);
  tracks.labelled[2] = true;
  SearchReports reports(std::chrono::milliseconds(400));

  const SearchReport& report = reports.make(kAnna, true, tracks, stationary, kStart + kStep);

  EXPECT_TRUE(report.is_fitted);
  EXPECT_EQ(report.confirmed, 2U);
  EXPECT_EQ(report.still, 1U);
  ASSERT_EQ(report.points.size(), 3U);
  EXPECT_EQ(report.points[2].v.x(), 3.0);  // the stationary candidate comes last
}

}  // namespace search_reports_test
}  // namespace mocap::label
