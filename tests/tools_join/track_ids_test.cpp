#include "lib/join/track_ids.h"

#include <gmock/gmock.h>

#include "tools_join/example_states.h"

namespace mocap::join {
namespace track_ids_test {

using ::testing::ElementsAre;

// Two labelled tracks and one without a label.
v1::Snapshot with_tracks(std::uint32_t one, std::uint32_t two, std::uint32_t three, double shift_m = 0.0) {
  v1::Snapshot snapshot;
  v1::LabelledMarkers& markers = *snapshot.add_subjects()->mutable_markers();
  add_marker(markers, {0.0, shift_m, 1.0}, one);
  add_marker(markers, {1.0, shift_m, 1.0}, two);
  snapshot.mutable_unlabelled()->add_track_ids_plus_one(three);
  for (const float number : {2.0F, static_cast<float>(shift_m), 1.0F}) {
    snapshot.mutable_unlabelled()->add_positions_m(number);
  }
  return snapshot;
}

std::vector<std::uint32_t> ids_in(const v1::Snapshot& snapshot) {
  const auto& labelled = snapshot.subjects(0).markers().track_ids_plus_one();
  std::vector<std::uint32_t> ids(labelled.begin(), labelled.end());
  ids.push_back(snapshot.unlabelled().track_ids_plus_one(0));
  return ids;
}

std::vector<std::uint32_t> renumbered(TrackIds& ids, v1::Snapshot snapshot) {
  ids.renumber(snapshot);
  return ids_in(snapshot);
}

TEST(TrackIdsOfChunks, RemainInTheFirstChunk) {
  TrackIds ids;

  EXPECT_THAT(renumbered(ids, with_tracks(7, 0, 9)), ElementsAre(7, 0, 9));
}

TEST(TrackIdsOfChunks, AreNewInTheNextChunk) {
  TrackIds ids;
  renumbered(ids, with_tracks(7, 0, 9));

  ids.go_over();

  EXPECT_THAT(renumbered(ids, with_tracks(9, 0, 7)), ElementsAre(10, 0, 11));
  EXPECT_THAT(renumbered(ids, with_tracks(7, 3, 9)), ElementsAre(11, 12, 10)) << "each track keeps its id";
}

TEST(TrackIdsOfChunks, GoOnWhereATrackIsAtTheSamePlace) {
  TrackIds ids;
  v1::Snapshot earlier = with_tracks(7, 8, 9);
  ids.renumber(earlier);

  ids.go_over();
  ids.go_on_from(earlier, with_tracks(3, 1, 2, 0.009));

  EXPECT_THAT(renumbered(ids, with_tracks(3, 1, 2)), ElementsAre(7, 8, 9));
  EXPECT_THAT(renumbered(ids, with_tracks(4, 1, 2)), ElementsAre(10, 8, 9));
}

TEST(TrackIdsOfChunks, AreNewWhereNoTrackWas) {
  TrackIds ids;
  v1::Snapshot earlier = with_tracks(7, 8, 9);
  ids.renumber(earlier);

  ids.go_over();
  ids.go_on_from(earlier, with_tracks(7, 8, 9, 0.011));

  EXPECT_THAT(renumbered(ids, with_tracks(7, 8, 9)), ElementsAre(10, 11, 12));
}

TEST(TrackIdsOfChunks, AreGivenOnce) {
  TrackIds ids;
  v1::Snapshot earlier = with_tracks(7, 8, 9), later = with_tracks(1, 2, 3);
  ids.renumber(earlier);
  for (int axis = 0; axis < 3; ++axis) {  // track 3 is 4 mm from track 1
    later.mutable_unlabelled()->set_positions_m(
        axis, later.subjects(0).markers().positions_m(axis) + (axis == 2 ? 0.004F : 0.0F));
  }

  ids.go_over();
  ids.go_on_from(earlier, later);

  EXPECT_THAT(renumbered(ids, later), ElementsAre(7, 8, 10)) << "the nearer one goes on";
}

}  // namespace track_ids_test
}  // namespace mocap::join
