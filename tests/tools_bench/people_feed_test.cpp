#include "bench/bridges/people_feed.h"

#include <gtest/gtest.h>

#include "bench/bridges/frame_number.h"
#include "settings/subject/marker_set_file.h"
#include "support/places.h"
#include "wire/zmq_subscriber.h"

namespace people_feed_test {

using namespace mocap;         // NOLINT: the class under test
using namespace mocap::bench;  // NOLINT: the class under test

MarkerSet baseline() {
  return *settings::load_marker_set(support::source_folder() + "/config/markersets/baseline41.toml");
}

TEST(PeopleFeed, TheHipsOfEveryPersonCountTheFrames) {
  Description description;
  for (const char* name : {"one", "two"}) description.subjects.push_back({name, baseline()});
  const Snapshot origin = people_at_origin(description);
  Snapshot moved = origin;

  move_people(origin, kStep_m * 77.0, moved);
  move_people(origin, kStep_m * 1234567.0, moved);

  ASSERT_EQ(moved.poses.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(moved.poses[i].bones[0].world_from_bone.position.x(), kStep_m * 1234567.0);
    EXPECT_EQ(moved.labels[i].markers.size(), baseline().markers.size());
  }
  EXPECT_NE(moved.poses[0].bones[0].world_from_bone.position.y(), moved.poses[1].bones[0].world_from_bone.position.y());
}

TEST(PeopleFeed, ASubscriberGetsTheFrameWithItsNumber) {
  auto feed = PeopleFeed::open(baseline(), 2, 120.0);
  ASSERT_TRUE(feed.has_value());
  auto subscriber = wire::ZmqSubscriber::open({.endpoint = feed->endpoint(), .topics = {wire::kSnapshotTopic}});
  ASSERT_TRUE(subscriber.has_value());
  const FrameTimes times{.first_ns = 1000, .period_ns = 8'333'333};

  v1::Snapshot received;
  for (int attempt = 0; attempt < 1000 && received.number() == 0; ++attempt) {
    ASSERT_TRUE(feed->send(42, times));
    const auto message = (*subscriber)->next(std::chrono::milliseconds(100));
    if (!message) continue;
    ASSERT_TRUE(received.ParseFromString(message->payload));
  }

  EXPECT_EQ(received.number(), 42U);
  EXPECT_EQ(received.instants().exposed_at_ns(), times.exposed_ns(42));
  EXPECT_EQ(received.subjects_size(), 2);
}

}  // namespace people_feed_test
