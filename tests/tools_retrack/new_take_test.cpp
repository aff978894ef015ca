#include "lib/retrack/new_take.h"

#include <gtest/gtest.h>

#include "support/temporary_folder.h"
#include "take/example_take.h"
#include "take/mcap/edit.h"

namespace mocap::retrack {
namespace new_take_test {

class NewTakeOfAnExample : public testing::Test {
 protected:
  NewTakeOfAnExample() {
    const std::filesystem::path path = folder_.path() / "walk-3.mcap";
    take::record_example(path, 20);
    from_ = std::make_unique<take::TakeReader>(*take::TakeReader::open(path));
  }

  NewTake create(const Span& span = {}) const {
    auto made = NewTake::create(folder_.path() / "new.mcap", *from_, span, {take::example_description()});
    EXPECT_TRUE(made) << made.error().message;
    return *std::move(made);
  }

  static TakeSet set_with(std::optional<RecordedSnapshot> snapshot,
                          std::initializer_list<const BlobFrame*> views = {}) {
    TakeSet set;
    for (const BlobFrame* view : views) set.frames.views.push_back(view);
    set.recorded = std::move(snapshot);
    return set;
  }

  // The snapshot of a set as the example has it, with the stamps of a live run.
  static RecordedSnapshot recorded(std::uint64_t set) {
    RecordedSnapshot snapshot;
    wire::encode(take::example_snapshot(set), snapshot.message);
    snapshot.message.mutable_instants()->set_fused_at_ns(1234);
    snapshot.message.set_utc_minus_host_ns(take::example_start().info.utc_minus_host.count());
    snapshot.message.mutable_timecode()->set_hours(7);
    snapshot.message.set_delivering_cameras(2);
    snapshot.bytes = snapshot.message.SerializeAsString();
    return snapshot;
  }

  support::TemporaryFolder folder_;
  std::unique_ptr<take::TakeReader> from_;
};

TEST_F(NewTakeOfAnExample, TakesOverTheStampsThatTrackingDoesNotGive) {
  NewTake made = create();

  const auto same = made.append(take::example_snapshot(3), set_with(recorded(3)));
  RecordedSnapshot other = recorded(4);
  other.bytes += "x";
  const auto different = made.append(take::example_snapshot(4), set_with(other));

  EXPECT_TRUE(same && *same);
  EXPECT_TRUE(different && !*different);
}

TEST_F(NewTakeOfAnExample, HasWhatIsInItsSpan) {
  NewTake made = create({take::example_time(5), take::example_time(7)});
  for (std::uint64_t set = 0; set < 10; ++set) {
    ASSERT_TRUE(made.append(take::example_blobs(0, set)));
    ASSERT_TRUE(made.append(take::example_snapshot(set), set_with({})));
  }

  const auto path = made.finish();

  ASSERT_TRUE(path) << path.error().message;
  const auto take = take::TakeReader::open(*path);
  ASSERT_TRUE(take) << take.error().message;
  EXPECT_EQ(take->counts().at("snapshot"), 3U);
  EXPECT_EQ(take->counts().at("blobs/camera0"), 3U);
  EXPECT_EQ(take->info().started_at, take::example_time(5));
  EXPECT_EQ(take->info().start_timecode, "") << "it was that of the whole take";
  EXPECT_EQ(take->info().notes, from_->info().notes);
}

// The original is of a version that did not check its texts.
TEST_F(NewTakeOfAnExample, IsMadeOfATakeWhoseNotesAreNotUtf8) {
  take::TakeInfo old = from_->info();
  old.notes = "caf\xE9";
  const std::filesystem::path path = folder_.path() / "walk-3.mcap";
  ASSERT_TRUE(take::mcap::add_metadata(path, take::encode(old)));
  from_ = std::make_unique<take::TakeReader>(*take::TakeReader::open(path));
  NewTake made = create();
  ASSERT_TRUE(made.append(take::example_snapshot(3), set_with({})));

  const auto finished = made.finish();

  ASSERT_TRUE(finished) << finished.error().message;
  EXPECT_EQ(take::TakeReader::open(*finished)->info().notes, "caf?");
}

// Camera 1 exposes 2 ms after the mean of its set.
TEST_F(NewTakeOfAnExample, HasTheImagesOfItsFirstAndLastSet) {
  NewTake made = create({take::example_time(5), take::example_time(7)});
  for (std::uint64_t set = 0; set < 10; ++set) {
    const BlobFrame first = take::example_blobs(0, set);
    BlobFrame second = take::example_blobs(1, set);
    second.exposed_at += std::chrono::milliseconds(2);
    ASSERT_TRUE(made.append(first));
    ASSERT_TRUE(made.append(second));
    ASSERT_TRUE(made.append(take::example_snapshot(set), set_with({}, {&first, &second})));
  }

  const auto path = made.finish();

  const auto take = take::TakeReader::open(*path);
  ASSERT_TRUE(take) << take.error().message;
  EXPECT_EQ(take->counts().at("blobs/camera0"), 3U);
  EXPECT_EQ(take->counts().at("blobs/camera1"), 3U);
}

TEST_F(NewTakeOfAnExample, DescribesABodyThatWasFittedBeforeItsSpan) {
  NewTake made = create({take::example_time(5), take::example_time(7)});
  SubjectFit fit;
  fit.subject = SubjectId{0};
  fit.description_version = 9;
  const MarkerSet set = take::example_description().subjects[0].marker_set;
  for (const Bone& bone : set.skeleton.bones) fit.rest_offsets_m.push_back(bone.rest_offset_m);
  for (const MarkerOnBone& marker : set.markers) fit.marker_offsets_m.push_back(marker.offset_m);
  ASSERT_TRUE(made.learn(fit, take::example_time(2)));
  ASSERT_TRUE(made.append(take::example_snapshot(2), set_with({})));
  ASSERT_TRUE(made.append(take::example_snapshot(6), set_with({})));

  const auto path = made.finish();

  const auto take = take::TakeReader::open(*path);
  ASSERT_TRUE(take) << take.error().message;
  EXPECT_EQ(take->counts().at("description"), 2U);
}

}  // namespace new_take_test
}  // namespace mocap::retrack
