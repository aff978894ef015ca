#include "chaos/virtual_feed.h"

#include <gmock/gmock.h>

#include "chaos/virtual_subscriber.h"
#include "support/typical_snapshot.h"
#include "wire/codec/encode.h"

namespace mocap::chaos {
namespace virtual_feed_test {

using ::testing::HasSubstr;
using ::testing::Optional;

std::string bytes_of(const Snapshot& snapshot) {
  v1::Snapshot message;
  wire::encode(snapshot, message);
  return message.SerializeAsString();
}

TEST(VirtualSubscriber, FindsASnapshotOfAnotherDescription) {
  const Description description = support::typical_description();
  Snapshot snapshot = support::typical_snapshot(description);
  VirtualSubscriber subscriber;

  subscriber.receive_snapshot(bytes_of(snapshot), false);  // waits for the description
  subscriber.receive_description(wire::encode(description).SerializeAsString(), false);
  subscriber.receive_snapshot(bytes_of(snapshot), false);
  EXPECT_EQ(subscriber.finding(), std::nullopt);

  snapshot.description_version = 2;
  subscriber.receive_snapshot(bytes_of(snapshot), false);
  EXPECT_THAT(subscriber.finding(), Optional(HasSubstr("description 2")));
}

TEST(VirtualSubscriber, ForgivesADamagedMessageOnly) {
  VirtualSubscriber subscriber;

  subscriber.receive_snapshot("\xFF\xFF", true);
  EXPECT_EQ(subscriber.finding(), std::nullopt);

  subscriber.receive_snapshot("\xFF\xFF", false);
  EXPECT_THAT(subscriber.finding(), Optional(HasSubstr("cannot be parsed")));
}

struct Feed {
  Episode episode;
  Description description = support::typical_description();
  VirtualFeed feed{episode, description};
};

TEST(VirtualFeed, SendsTheDescriptionOfAFitBeforeTheSnapshotThatRefersToIt) {
  Feed fitted;
  Snapshot snapshot = support::typical_snapshot(fitted.description);
  const MarkerSet& set = fitted.description.subjects[0].marker_set;
  SubjectFit fit;
  fit.subject = SubjectId{0};
  fit.description_version = snapshot.description_version = 2;
  for (const Bone& bone : set.skeleton.bones) fit.rest_offsets_m.push_back(bone.rest_offset_m);
  for (const MarkerOnBone& marker : set.markers) fit.marker_offsets_m.push_back(marker.offset_m);

  EXPECT_TRUE(fitted.feed.push(snapshot, fit));
  fitted.feed.send(0.0);

  EXPECT_EQ(fitted.feed.finding(), std::nullopt);
  EXPECT_EQ(fitted.feed.sent_description().version, 2u);
}

TEST(VirtualFeed, FindsAVersionThatNoFitExplains) {
  Feed broken;
  Snapshot snapshot = support::typical_snapshot(broken.description);
  snapshot.description_version = 2;

  broken.feed.push(snapshot, std::nullopt);
  broken.feed.send(0.0);

  EXPECT_THAT(broken.feed.finding(), Optional(HasSubstr("description 2")));
}

TEST(VirtualFeed, CountsTheSnapshotsThatAFullQueueDrops) {
  Feed stalled;
  Snapshot snapshot = support::typical_snapshot(stalled.description);
  bool full = false;
  for (int i = 0; i < 100; ++i) {
    ++snapshot.number;
    full = !stalled.feed.push(snapshot, std::nullopt) || full;
  }

  stalled.feed.send(0.0);

  EXPECT_TRUE(full);
  EXPECT_EQ(stalled.feed.finding(), std::nullopt);
}

}  // namespace virtual_feed_test
}  // namespace mocap::chaos
