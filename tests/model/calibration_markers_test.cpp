#include "model/calibration/calibration_markers.h"

#include <gtest/gtest.h>

#include <memory>

#include "model/snapshot.h"

namespace mocap {
namespace calibration_markers_test {

TEST(CalibrationMarkers, AreTheMeasuredMarkersWithAndWithoutALabel) {
  const auto snapshot = std::make_unique<Snapshot>();
  snapshot->instants.exposed_at = Timestamp{Duration(5)};
  SubjectLabels subject;
  for (const auto& [state, track] :
       {std::pair{LabelState::Measured, 1u}, {LabelState::Filled, 2u}, {LabelState::Lost, 3u}}) {
    LabelledMarker marker;
    marker.state = state;
    marker.track = TrackId{track};
    static_cast<void>(subject.markers.try_push_back(marker));
  }
  static_cast<void>(snapshot->labels.try_push_back(subject));
  static_cast<void>(snapshot->unlabelled.try_push_back({TrackId{4}, WorldPoint{}, 0.1, 3}));

  const CalibrationMarkers found = measured_markers(*snapshot);

  EXPECT_EQ(found.exposed_at, Timestamp{Duration(5)});
  ASSERT_EQ(found.markers.size(), 2u);
  EXPECT_EQ(found.markers[0].track, TrackId{1});
  EXPECT_EQ(found.markers[1].track, TrackId{4});
  EXPECT_EQ(found.markers[1].cameras, 3u);
}

}  // namespace calibration_markers_test
}  // namespace mocap
