#include "web/feed/hub.h"

#include <gmock/gmock.h>

namespace mocap::web {
namespace hub_test {

constexpr Timestamp kStart = from_ns(1'000'000'000);
Timestamp at_s(double seconds) { return kStart + from_s(seconds); }

wire::LinkStatus connected() {
  wire::LinkStatus link;
  link.connected = true;
  return link;
}

TEST(Hub, GivesALateViewerTheCurrentDescriptionAndHealth) {
  Hub hub("tcp://127.0.0.1:5570", kStart);
  v1::Description description;
  description.set_version(7);
  hub.take({{"description", description.SerializeAsString()}, {"health", ""}, {"snapshot", "s"}}, kStart);
  Viewer viewer([] {});
  hub.join(viewer);

  hub.subscribe(viewer, {"description", "health", "snapshot"});

  EXPECT_EQ(*viewer.next()->bytes, *framed("description", description.SerializeAsString()));
  EXPECT_EQ(*viewer.next()->bytes, *framed("health", ""));
  EXPECT_FALSE(viewer.next());
  EXPECT_EQ(hub.description()->version(), 7U);
}

TEST(Hub, GivesNobodyTheDescriptionOfADaemonThatIsGone) {
  Hub hub("tcp://127.0.0.1:5570", kStart);
  hub.note_link(connected());
  hub.take({{"description", ""}, {"health", ""}}, kStart);

  hub.note_link({});
  hub.note_link(connected());
  Viewer viewer([] {});
  hub.join(viewer);
  hub.subscribe(viewer, {"description", "health"});

  EXPECT_FALSE(viewer.next());
  EXPECT_EQ(hub.description(), nullptr);
  EXPECT_EQ(hub.health(), nullptr);
  hub.take({{"description", "new"}}, kStart);
  EXPECT_EQ(*viewer.next()->bytes, *framed("description", "new"));
}

TEST(Hub, AsksForTheTopicsOfItsViewersOnly) {
  Hub hub("tcp://127.0.0.1:5570", kStart);
  Viewer viewer([] {});
  EXPECT_THAT(hub.topics(), testing::ElementsAre("description", "event", "health"));

  hub.join(viewer);
  hub.subscribe(viewer, {"preview/north"});
  EXPECT_THAT(hub.topics(), testing::ElementsAre("description", "event", "health", "preview/north"));
  hub.leave(viewer);

  EXPECT_THAT(hub.topics(), testing::ElementsAre("description", "event", "health"));
}

TEST(Hub, SharesOneMessageAmongAllViewers) {
  Hub hub("tcp://127.0.0.1:5570", kStart);
  Viewer first([] {});
  Viewer second([] {});
  for (Viewer* viewer : {&first, &second}) {
    hub.join(*viewer);
    hub.subscribe(*viewer, {"snapshot"});
  }

  hub.take({{"snapshot", "s"}}, kStart);

  EXPECT_EQ(first.next()->bytes, second.next()->bytes);
}

TEST(Hub, IsConnectedWhileDataComes) {
  Hub hub("tcp://127.0.0.1:5570", kStart);
  EXPECT_FALSE(hub.status(kStart).connected);

  hub.note_link(connected());
  hub.take({{"health", ""}}, at_s(1));

  EXPECT_TRUE(hub.status(at_s(2)).connected);
  EXPECT_EQ(hub.status(at_s(2)).reason, "");
  EXPECT_EQ(hub.status(at_s(2)).age_s, 1.0);
  EXPECT_FALSE(hub.status(at_s(13)).connected);
  EXPECT_EQ(hub.status(at_s(13)).reason, "tcp://127.0.0.1:5570: connected, but no data for 12 s");
}

TEST(Hub, SaysWhyThereIsNoConnection) {
  Hub hub("tcp://127.0.0.1:5570", kStart);
  wire::LinkStatus link;
  link.fault = wire::LinkFault::NothingListens;

  hub.note_link(link);

  EXPECT_THAT(hub.status(at_s(1)).reason, testing::HasSubstr("tcp://127.0.0.1:5570"));
  EXPECT_THAT(hub.status(at_s(1)).reason, testing::Not(testing::HasSubstr("connecting")));
}

TEST(Hub, KeepsTheLastHealthIfAMessageIsMalformed) {
  Hub hub("tcp://127.0.0.1:5570", kStart);
  v1::Health health;
  health.set_sets(3);
  hub.take({{"health", health.SerializeAsString()}}, kStart);

  hub.take({{"health", "\xFF\xFF"}}, kStart);

  EXPECT_EQ(hub.health()->sets(), 3U);
}

TEST(Hub, CountsTheSnapshotsThatViewersMissedAlsoAfterTheyLeft) {
  Hub hub("tcp://127.0.0.1:5570", kStart);
  Viewer viewer([] {});
  hub.join(viewer);
  hub.subscribe(viewer, {"snapshot"});

  for (int i = 0; i < 3; ++i) hub.take({{"snapshot", "s"}}, kStart);
  EXPECT_EQ(hub.dropped_snapshots(), 2U);
  hub.leave(viewer);

  EXPECT_EQ(hub.dropped_snapshots(), 2U);
}

}  // namespace hub_test
}  // namespace mocap::web
