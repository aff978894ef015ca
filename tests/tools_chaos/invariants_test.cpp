#include "chaos/invariants.h"

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

#include "support/temporary_folder.h"
#include "support/typical_snapshot.h"
#include "take/take_writer.h"

namespace mocap::chaos {
namespace invariants_test {

using ::testing::HasSubstr;
using ::testing::Optional;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

struct Whole {
  Description description = support::typical_description();
  Snapshot snapshot = support::typical_snapshot(description);
};

TEST(AllNumbersFinite, FindsANaNInMarkersBonesAndUnlabelledMarkers) {
  const Whole good;
  EXPECT_EQ(all_numbers_finite(good.snapshot), std::nullopt);

  Whole marker, bone, unlabelled;
  marker.snapshot.labels[0].markers[3].position.v.y() = kNaN;
  bone.snapshot.poses[0].bones[2].world_from_bone.rotation.coeffs().setZero();
  unlabelled.snapshot.unlabelled.push_back({TrackId{1}, {{0.0, kNaN, 0.0}}, 0.1, 2});

  EXPECT_THAT(all_numbers_finite(marker.snapshot), Optional(HasSubstr("marker 3")));
  EXPECT_THAT(all_numbers_finite(bone.snapshot), Optional(HasSubstr("bone 2")));
  EXPECT_THAT(all_numbers_finite(unlabelled.snapshot), Optional(HasSubstr("unlabelled")));
}

TEST(TimeGoesOn, FindsAnEarlierExposureAndARepeatedNumber) {
  const Whole first;
  Whole later, earlier, same;
  later.snapshot.number += 1;
  later.snapshot.instants.exposed_at += Duration{1};
  earlier.snapshot.number += 1;
  earlier.snapshot.instants.exposed_at -= Duration{1};

  EXPECT_EQ(time_goes_on(first.snapshot, later.snapshot), std::nullopt);
  EXPECT_THAT(time_goes_on(first.snapshot, earlier.snapshot), Optional(HasSubstr("1 ns before")));
  EXPECT_THAT(time_goes_on(first.snapshot, same.snapshot), Optional(HasSubstr("follows set")));
}

TEST(LabelsAreUnique, FindsATrackWithTwoLabelsAndASubjectThatOccursTwice) {
  const Whole good;
  Whole track, subject, both;
  track.snapshot.labels[0].markers[1].track = track.snapshot.labels[0].markers[0].track;
  subject.snapshot.labels.push_back(subject.snapshot.labels[0]);
  both.snapshot.unlabelled.push_back({both.snapshot.labels[0].markers[0].track, {}, 0.1, 2});

  EXPECT_EQ(labels_are_unique(good.snapshot), std::nullopt);
  EXPECT_THAT(labels_are_unique(track.snapshot), Optional(HasSubstr("two labels")));
  EXPECT_THAT(labels_are_unique(subject.snapshot), Optional(HasSubstr("occurs twice")));
  EXPECT_THAT(labels_are_unique(both.snapshot), Optional(HasSubstr("a label and none")));
}

TEST(FitsDescription, FindsAnotherVersionAndAnotherNumberOfMarkers) {
  const Whole good;
  Whole version, markers, stranger;
  version.snapshot.description_version += 1;
  markers.snapshot.labels[0].markers.pop_back();
  stranger.snapshot.labels[0].subject = SubjectId{7};

  EXPECT_EQ(fits_description(good.snapshot, good.description), std::nullopt);
  EXPECT_THAT(fits_description(version.snapshot, good.description), Optional(HasSubstr("description 2")));
  EXPECT_THAT(fits_description(markers.snapshot, good.description), Optional(HasSubstr("59 markers, expected 60")));
  EXPECT_THAT(fits_description(stranger.snapshot, good.description), Optional(HasSubstr("lacks")));
}

TEST(ImagesAreCounted, FindsALostImageAndOneThatIsCountedTwice) {
  const FrameCounts good{.received = 10, .used = 6, .dropped = 3, .waiting = 1, .passed_over = 0};
  FrameCounts lost = good, twice = good;
  lost.received += 1;
  twice.used += 1;

  EXPECT_EQ(images_are_counted(good, 2, true), std::nullopt);
  EXPECT_EQ(images_are_counted(lost, 2, false), std::nullopt);  // it may wait in the aligner
  EXPECT_NE(images_are_counted(lost, 2, true), std::nullopt);
  EXPECT_NE(images_are_counted(twice, 2, false), std::nullopt);
}

TEST(SurvivesWire, FindsASnapshotThatADecoderRefuses) {
  const Whole good;
  Whole broken;
  broken.snapshot.poses[0].bones[0].world_from_bone.position.x() = kNaN;

  EXPECT_EQ(snapshot_survives_wire(good.snapshot), std::nullopt);
  EXPECT_NE(snapshot_survives_wire(broken.snapshot), std::nullopt);
}

TEST(SurvivesWire, FindsADescriptionThatADecoderRefuses) {
  Whole whole;
  EXPECT_EQ(description_survives_wire(whole.description), std::nullopt);

  whole.description.subjects[0].marker_set.skeleton.bones[1].rest_offset_m.x() = kNaN;

  EXPECT_NE(description_survives_wire(whole.description), std::nullopt);
}

TEST(MemoryIsBounded, FindsAGrowthOverTheBound) {
  EXPECT_EQ(memory_is_bounded(kGrowth_bytes), std::nullopt);
  EXPECT_THAT(memory_is_bounded(kGrowth_bytes + 1), Optional(HasSubstr("1048577 bytes")));
}

std::filesystem::path write_take(const std::filesystem::path& folder) {
  const Whole whole;
  take::TakeStart start;
  start.info.name = "take";
  start.info.started_at = whole.snapshot.instants.exposed_at;
  start.info.utc_minus_host = std::chrono::hours(400'000);
  start.description = whole.description;
  auto writer = take::TakeWriter::create(folder / "take.mcap", start);
  EXPECT_TRUE(writer.has_value() && (*writer)->append(whole.snapshot) && (*writer)->finish(start.info));
  return folder / "take.mcap";
}

TEST(TakeIsWhole, FindsATakeWithoutItsIndexAndADamagedByte) {
  const support::TemporaryFolder folder;
  const std::filesystem::path take = write_take(folder.path());
  EXPECT_EQ(take_is_whole(take), std::nullopt);

  const auto size = std::filesystem::file_size(take);
  const std::filesystem::path cut = folder.path() / "cut.mcap", damaged = folder.path() / "damaged.mcap";
  std::filesystem::copy_file(take, cut);
  std::filesystem::copy_file(take, damaged);
  std::filesystem::resize_file(cut, size - 9);
  std::fstream file(damaged, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(static_cast<std::streamoff>(size / 2)).put('\x55').put('\x55');
  file.close();

  EXPECT_THAT(take_is_whole(cut), Optional(HasSubstr("ends within its index")));
  EXPECT_NE(take_is_whole(damaged), std::nullopt);
  EXPECT_NE(take_is_whole(folder.path() / "missing.mcap"), std::nullopt);
}

scoring::EvalFrame truth_of(const Snapshot& snapshot) {
  scoring::EvalFrame truth;
  const SubjectPose& pose = snapshot.poses[0];
  for (std::uint32_t b = 0; b < pose.bones.size(); ++b) {
    const Pose& bone = pose.bones[b].world_from_bone;
    truth.bones.push_back({0, b, BoneState::Measured, bone.position, bone.rotation});
  }
  truth.markers.push_back({0, 0, LabelState::Measured, Eigen::Vector3d::Zero(), 3});
  return truth;
}

TEST(SkeletonIsRight, FindsAMovedAndAMissingSkeletonThatCamerasSee) {
  Whole whole;
  scoring::EvalFrame truth = truth_of(whole.snapshot);
  EXPECT_EQ(skeleton_is_right(whole.snapshot, truth, 0, 0), std::nullopt);

  for (BonePose& bone : whole.snapshot.poses[0].bones) bone.world_from_bone.position.x() += 0.1;
  EXPECT_THAT(skeleton_is_right(whole.snapshot, truth, 0, 0), Optional(HasSubstr("100 mm rms off")));

  whole.snapshot.poses.clear();
  EXPECT_THAT(skeleton_is_right(whole.snapshot, truth, 0, 0), Optional(HasSubstr("no skeleton")));

  truth.markers[0].cameras = 1;  // out of sight: no judgement
  EXPECT_EQ(skeleton_is_right(whole.snapshot, truth, 0, 0), std::nullopt);
}

}  // namespace invariants_test
}  // namespace mocap::chaos
