#include "bridges/natnet/scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "bridges/frames.h"

namespace mocap::natnet {
namespace natnet_scene_test {

using bridge::testing::TestFrame;
using bridge::testing::TestSubject;
using ::testing::ElementsAre;

constexpr std::int64_t kNow_ns = 6'000'000'000;

TEST(NatNetScene, TheIdOfAnUnlabelledMarkerNamesNoModelAfterManyTracks) {
  v1::Snapshot said = bridge::testing::snapshot({TestSubject{}});
  for (const std::uint32_t track : {0U, 1U, 65535U, 65536U, 4'000'000'000U}) {
    said.mutable_unlabelled()->add_track_ids_plus_one(track);
    for (const float v : {1.0F, 2.0F, 3.0F}) said.mutable_unlabelled()->add_positions_m(v);
  }
  const TestFrame frame(bridge::testing::describe({TestSubject{}}), said, MOCAP_AXES_MOCAP);
  ASSERT_TRUE(frame.filled());
  SceneReader reader;

  std::vector<std::int32_t> ids;
  for (const Point& point : reader.read(frame.get(), true, kNow_ns).unlabelled) ids.push_back(point.id);

  EXPECT_THAT(ids, ElementsAre(0, 1, 65535, 1, (4'000'000'000U - 1) % 65535 + 1));
}

TEST(NatNetScene, HasNoTimecodeAfterTheLossOfTheDaemon) {
  v1::Snapshot said = bridge::testing::snapshot({TestSubject{}});
  said.mutable_timecode()->set_hours(10);
  said.mutable_timecode()->set_frames_per_second(25);
  said.mutable_timecode()->set_subframe(2);
  const TestFrame frame(bridge::testing::describe({TestSubject{}}), said, MOCAP_AXES_MOCAP);
  SceneReader reader;
  ASSERT_EQ(reader.read(frame.get(), true, kNow_ns).timecode, 0x0A000000U);

  const Scene& lost = reader.lose(kNow_ns);

  EXPECT_EQ(lost.timecode, 0U);
  EXPECT_EQ(lost.subframe, 0U);
}

}  // namespace natnet_scene_test
}  // namespace mocap::natnet
