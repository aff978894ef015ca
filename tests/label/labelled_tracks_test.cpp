#include "label/labelled_tracks.h"

#include <gtest/gtest.h>

#include "label/test_tracks.h"

namespace mocap::label {
namespace labelled_tracks_test {

TEST(LabelledTracks, FindATrackByItsId) {
  TrackedMarkers tracked;
  for (const std::uint32_t id : {7U, 3U, 9U}) tracked.push_back(test::detected_track(id, {0.1 * id, 0.0, 1.0}));
  LabelledTracks tracks;

  test::update(tracks, tracked);

  EXPECT_EQ(tracks.find(TrackId{3}), 1);
  EXPECT_EQ(tracks.find(TrackId{9}), 2);
  EXPECT_EQ(tracks.find(TrackId{4}), LabelledTracks::kNone);
  EXPECT_EQ(tracks[0].id, TrackId{7});
}

TEST(LabelledTracks, HaveNoLabelsInANewSet) {
  TrackedMarkers tracked;
  tracked.push_back(test::detected_track(1, {0.0, 0.0, 1.0}));
  LabelledTracks tracks;
  test::update(tracks, tracked);
  tracks.labelled[0] = tracks.trusted[0] = true;

  tracked.push_back(test::detected_track(2, {0.0, 0.0, 2.0}));
  test::update(tracks, tracked);

  ASSERT_EQ(tracks.labelled.size(), 2U);
  EXPECT_FALSE(tracks.labelled[0] || tracks.trusted[0]);
}

}  // namespace labelled_tracks_test
}  // namespace mocap::label
