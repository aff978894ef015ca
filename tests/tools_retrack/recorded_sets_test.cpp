#include "lib/retrack/recorded_sets.h"

#include <gtest/gtest.h>

#include <chrono>
#include <limits>
#include <vector>

namespace mocap::retrack {
namespace recorded_sets_test {

using std::chrono::milliseconds;

constexpr Timestamp kStart = from_ns(5'000'000'000);

Timestamp time_of(std::uint64_t set) { return kStart + milliseconds(10 * static_cast<std::int64_t>(set)); }

BlobFrame image(std::uint32_t camera, std::uint64_t set, Duration skew = {}) {
  BlobFrame frame;
  frame.camera = CameraId{camera};
  frame.number = 100 * camera + set;
  frame.exposed_at = time_of(set) + skew;
  return frame;
}

// A snapshot of the images of these cameras, as the daemon describes it.
RecordedSnapshot snapshot_of(std::uint64_t set, const std::vector<BlobFrame>& images, std::uint32_t delivering = 2) {
  RecordedSnapshot snapshot;
  snapshot.message.set_number(set);
  Duration sum{0};
  for (const BlobFrame& frame : images) sum += frame.exposed_at - time_of(set);
  const Timestamp mean = time_of(set) + sum / static_cast<Duration::rep>(images.size());
  snapshot.message.mutable_instants()->set_exposed_at_ns(to_ns(mean));
  snapshot.message.set_delivering_cameras(delivering);
  for (const BlobFrame& frame : images) {
    v1::Views& views = *snapshot.message.mutable_views();
    views.add_cameras(frame.camera.value);
    views.add_frame_numbers(frame.number);
    views.add_skews_ns((frame.exposed_at - mean).count());
    views.add_blobs(0);
  }
  return snapshot;
}

const std::vector<CameraId> kBoth{CameraId{0}, CameraId{1}};

TEST(RecordedSets, HaveTheImagesThatTheSnapshotNames) {
  RecordedSets sets(kBoth, 2);
  const BlobFrame west = image(0, 3), east = image(1, 3, Duration(200'000));
  sets.add(image(0, 2));  // in no set: its set was passed over
  sets.add(west);
  sets.add(snapshot_of(3, {west, east}, 1));
  EXPECT_FALSE(sets.next(time_of(3) + Duration(150'000))) << "the last image may still come";
  sets.add(east);

  const auto set = sets.next(time_of(4));

  ASSERT_TRUE(set);
  EXPECT_EQ(set->frames.number, 3U);
  ASSERT_EQ(set->frames.views.size(), 2U);
  EXPECT_EQ(set->frames.views[0]->number, west.number);
  EXPECT_EQ(set->frames.views[1]->number, east.number);
  EXPECT_EQ(to_ns(set->frames.exposed_at), set->recorded->message.instants().exposed_at_ns());
  EXPECT_EQ(set->frames.expected_views, 1U);
  EXPECT_EQ(set->missing_views, 0U);
  EXPECT_FALSE(sets.next(Timestamp::max()));
}

TEST(RecordedSets, CountTheImagesThatTheTakeLacks) {
  RecordedSets sets(kBoth, 2);
  const BlobFrame west = image(0, 3), east = image(1, 3);
  sets.add(west);
  sets.add(snapshot_of(3, {west, east}));

  const auto set = sets.next(Timestamp::max());

  ASSERT_TRUE(set);
  EXPECT_EQ(set->frames.views.size(), 1U);
  EXPECT_EQ(set->missing_views, 1U);
}

TEST(RecordedSets, UseTheCamerasOfTheSettings) {
  RecordedSets sets({CameraId{1}, CameraId{}, CameraId{0}}, 2);
  BlobFrame first = image(0, 3), third = image(2, 3);
  const RecordedSnapshot snapshot = snapshot_of(3, {first, image(1, 3), third}, 3);
  first.camera = CameraId{1};
  third.camera = CameraId{0};
  sets.add(first);
  sets.add(third);
  sets.add(snapshot);

  const auto set = sets.next(Timestamp::max());

  ASSERT_TRUE(set);
  ASSERT_EQ(set->frames.views.size(), 2U);
  EXPECT_EQ(set->frames.views[0]->camera, CameraId{0});
  EXPECT_EQ(set->frames.views[1]->camera, CameraId{1});
  EXPECT_EQ(set->frames.expected_views, 2U);
  EXPECT_EQ(set->missing_views, 0U);
}

TEST(RecordedSets, PassOverSnapshotsThatNameNoImage) {
  RecordedSets sets(kBoth, 2);
  RecordedSnapshot broken = snapshot_of(3, {image(0, 3)});
  broken.message.mutable_views()->clear_skews_ns();
  sets.add(broken);
  RecordedSnapshot foreign = snapshot_of(4, {image(0, 4)});
  foreign.message.mutable_views()->set_cameras(0, 4'000'000'000);
  sets.add(foreign);
  const BlobFrame west = image(0, 5);
  sets.add(west);
  sets.add(snapshot_of(5, {west, west}));  // one camera twice

  const auto set = sets.next(Timestamp::max());

  ASSERT_TRUE(set);
  EXPECT_EQ(set->frames.number, 5U);
  EXPECT_EQ(set->frames.views.size(), 1U);
}

TEST(RecordedSets, AreBoundedIfNoImageComes) {
  RecordedSets sets(kBoth, 2);
  for (std::uint64_t set = 0; set < 5000; ++set) {
    sets.add(image(0, set));
    RecordedSnapshot snapshot = snapshot_of(set, {image(1, set)});
    snapshot.message.mutable_views()->set_skews_ns(0, std::numeric_limits<std::int64_t>::max());
    sets.add(std::move(snapshot));
    EXPECT_FALSE(sets.next(time_of(0)));
  }
}

}  // namespace recorded_sets_test
}  // namespace mocap::retrack
