#include "web/feed/viewer.h"

#include <gmock/gmock.h>

namespace mocap::web {
namespace viewer_test {

std::vector<std::string> all_of(Viewer& viewer) {
  std::vector<std::string> texts;
  while (auto message = viewer.next()) texts.push_back(*message->bytes);
  return texts;
}

std::shared_ptr<const std::string> message(const std::string& text) {
  return std::make_shared<const std::string>(text);
}

TEST(Viewer, FramesAPayloadWithTheLengthOfItsTopic) {
  EXPECT_EQ(*framed("health", std::string("\0\x01", 2)), std::string("\x06health\0\x01", 9));
}

TEST(Viewer, KeepsTheNewestMessageOfATopicAndCountsReplacedSnapshots) {
  Viewer viewer([] {});
  viewer.subscribe({"health", "snapshot"});

  for (const char* text : {"1", "2", "3"}) viewer.offer("snapshot", message(text));
  for (const char* text : {"a", "b"}) viewer.offer("health", message(text));

  EXPECT_THAT(all_of(viewer), testing::UnorderedElementsAre("3", "b"));
  EXPECT_EQ(viewer.dropped_snapshots(), 2U);
}

TEST(Viewer, SendsTheNextSnapshotOnlyAfterThePageHasDrawn) {
  Viewer viewer([] {});
  viewer.subscribe({"snapshot"});
  viewer.offer("snapshot", message("1"));
  EXPECT_THAT(all_of(viewer), testing::ElementsAre("1"));

  viewer.offer("snapshot", message("2"));
  EXPECT_THAT(all_of(viewer), testing::IsEmpty());
  viewer.note_drawn();

  EXPECT_THAT(all_of(viewer), testing::ElementsAre("2"));
}

TEST(Viewer, DoesNotWakeForASnapshotThatMustWait) {
  int woken = 0;
  Viewer viewer([&] { ++woken; });
  viewer.subscribe({"snapshot"});
  viewer.offer("snapshot", message("1"));
  viewer.next();

  viewer.offer("snapshot", message("2"));

  EXPECT_EQ(woken, 1);
}

TEST(Viewer, IgnoresTopicsThatThePageDoesNotWant) {
  Viewer viewer([] {});
  viewer.subscribe({"health"});
  viewer.offer("health", message("h"));

  viewer.subscribe({"snapshot"});
  viewer.offer("health", message("h"));

  EXPECT_THAT(all_of(viewer), testing::IsEmpty());
}

TEST(Viewer, QueuesTheLast64Events) {
  Viewer viewer([] {});
  viewer.subscribe({"event"});

  for (int i = 0; i < 70; ++i) viewer.offer("event", message(std::to_string(i)));

  const std::vector<std::string> events = all_of(viewer);
  ASSERT_EQ(events.size(), 64U);
  EXPECT_EQ(events.front(), "6");
  EXPECT_EQ(events.back(), "69");
}

TEST(Viewer, RefusesTextsOfAPageThatDoesNotRead) {
  Viewer viewer([] {});

  for (int i = 0; i < 64; ++i) EXPECT_TRUE(viewer.say("text"));

  EXPECT_FALSE(viewer.say("text"));
}

TEST(Viewer, SendsStateTextsAndDescriptionBeforeTheRest) {
  Viewer viewer([] {});
  viewer.subscribe({"description", "event", "snapshot"});
  viewer.offer("snapshot", message("snapshot"));
  viewer.offer("event", message("event"));
  viewer.offer("description", message("description"));
  viewer.say("text");
  viewer.say_state("old");
  viewer.say_state("state");

  EXPECT_THAT(all_of(viewer), testing::ElementsAre("state", "text", "description", "event", "snapshot"));
}

TEST(Viewer, SendsSightingsAtThePaceAtWhichThePageDraws) {
  Viewer viewer([] {});
  viewer.subscribe({"sightings", "snapshot"});
  viewer.offer("snapshot", message("snapshot 1"));
  EXPECT_THAT(all_of(viewer), testing::ElementsAre("snapshot 1"));

  viewer.offer("sightings", message("sightings 1"));
  viewer.offer("snapshot", message("snapshot 2"));
  viewer.offer("sightings", message("sightings 2"));
  EXPECT_THAT(all_of(viewer), testing::IsEmpty());
  viewer.note_drawn();

  EXPECT_THAT(all_of(viewer), testing::ElementsAre("sightings 2", "snapshot 2"));
}

TEST(Viewer, LetsNoTopicStarveAnother) {
  Viewer viewer([] {});
  viewer.subscribe({"preview/a", "preview/b"});
  std::vector<std::string> sent;

  for (int i = 0; i < 4; ++i) {
    viewer.offer("preview/a", message("a"));
    viewer.offer("preview/b", message("b"));
    sent.push_back(*viewer.next()->bytes);
  }

  EXPECT_THAT(sent, testing::ElementsAre("a", "b", "a", "b"));
}

}  // namespace viewer_test
}  // namespace mocap::web
