#include "cameras/replay/replay_recording.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/temporary_folder.h"

namespace mocap::cameras {
namespace replay_recording_test {

using testing::HasSubstr;

constexpr const char* kTimes = "frame,time_ns\n7,1000\n8,1500\n10,2500\n";

TEST(RecordedTimes, AreReadByFrameNumberWithAnyLineEnd) {
  const support::TemporaryFolder folder;

  const auto times = read_recorded_times(folder.write("times.csv", "frame,time_ns\r\n7,1000\r\n\r\n10,2500\r\n"));

  ASSERT_TRUE(times) << times.error().message;
  EXPECT_EQ(*times, (RecordedTimes{{7, from_ns(1000)}, {10, from_ns(2500)}}));
}

TEST(RecordedTimes, OfAnAbsentFileAreNotFound) {
  const support::TemporaryFolder folder;

  EXPECT_EQ(read_recorded_times(folder.path() / "none.csv").error().code, ErrorCode::NotFound);
}

TEST(RecordedTimes, OfAFileWithoutRowsAreRefused) {
  const support::TemporaryFolder folder;

  for (const char* text : {"", "frame,time_ns\n", "frame,time_ns\n\n"}) {
    const auto times = read_recorded_times(folder.write("times.csv", text));
    ASSERT_FALSE(times) << text;
    EXPECT_EQ(times.error().code, ErrorCode::InvalidArgument);
    EXPECT_THAT(times.error().message, HasSubstr("times.csv has no row"));
  }
}

TEST(RecordedTimes, OfAFileThatCannotBeReadToItsEndAreRefused) {
  const support::TemporaryFolder folder;  // a folder opens, and its first read fails

  EXPECT_EQ(read_recorded_times(folder.path()).error().code, ErrorCode::Io);
}

TEST(FindRecording, RefusesAVideoWhoseFileOfTimesIsEmpty) {
  const support::TemporaryFolder folder;
  folder.write("take.mkv", "");
  folder.write("timestamps.csv", "");

  EXPECT_EQ(find_recording(folder.path(), "north", 60.0).error().code, ErrorCode::InvalidArgument);
}

TEST(FindRecording, RefusesNamesThatAreTimes) {
  const support::TemporaryFolder folder;
  folder.write("1795772164700852004.png", "");

  const auto recording = find_recording(folder.path(), "north", 1.0);

  ASSERT_FALSE(recording);
  EXPECT_EQ(recording.error().code, ErrorCode::InvalidArgument);
  EXPECT_THAT(recording.error().message, HasSubstr("1795772164700852004.png: frame 1795772164700852004 would be"));
  EXPECT_THAT(recording.error().message, HasSubstr("write " + (folder.path() / "timestamps.csv").string()));
}

TEST(FindRecording, OrdersImagesByNumberAndIgnoresOtherFiles) {
  const support::TemporaryFolder folder;
  for (const char* name : {"10.pgm", "9.png", "0008.pgm", "notes.txt", "cover.png", "-1.pgm"}) folder.write(name, "");

  const auto recording = find_recording(folder.path(), "north", 100.0);

  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_TRUE(recording->video.empty());
  ASSERT_EQ(recording->frames.size(), 3U);
  EXPECT_EQ(recording->frames[0].number, 8U);
  EXPECT_EQ(recording->frames[1].file.filename(), "9.png");
  EXPECT_EQ(recording->frames[2].number, 10U);
  EXPECT_EQ(recording->frames[2].exposed_at, from_ns(100'000'000)) << "10 periods of 10 ms after 0";
}

TEST(FindRecording, PrefersTheFolderOfTheCamera) {
  const support::TemporaryFolder folder;
  folder.write("1.pgm", "");
  folder.write("north/2.pgm", "");

  EXPECT_EQ(find_recording(folder.path(), "north", 60.0)->frames.at(0).number, 2U);
  EXPECT_EQ(find_recording(folder.path(), "south", 60.0)->frames.at(0).number, 1U);
}

TEST(FindRecording, TakesTheTimesOfTheFile) {
  const support::TemporaryFolder folder;
  folder.write("timestamps.csv", kTimes);
  folder.write("8.pgm", "");
  folder.write("10.pgm", "");

  const auto recording = find_recording(folder.path(), "north", 60.0);

  ASSERT_TRUE(recording) << recording.error().message;
  ASSERT_EQ(recording->frames.size(), 2U) << "a row without an image is a lost image";
  EXPECT_EQ(recording->frames[0].exposed_at, from_ns(1500));
  EXPECT_EQ(recording->frames[1].exposed_at, from_ns(2500));
}

TEST(FindRecording, RefusesAnImageWithoutATime) {
  const support::TemporaryFolder folder;
  folder.write("timestamps.csv", kTimes);
  folder.write("9.pgm", "");

  const auto recording = find_recording(folder.path(), "north", 60.0);

  ASSERT_FALSE(recording);
  EXPECT_EQ(recording.error().code, ErrorCode::InvalidArgument);
  EXPECT_THAT(recording.error().message, HasSubstr("timestamps.csv: no row for frame 9"));
}

TEST(FindRecording, GivesTheFramesOfAVideoTheNumbersOfTheRows) {
  const support::TemporaryFolder folder;
  folder.write("timestamps.csv", kTimes);
  const auto video = folder.write("take.mkv", "");

  const auto recording = find_recording(folder.path(), "north", 60.0);

  ASSERT_TRUE(recording) << recording.error().message;
  EXPECT_EQ(recording->video, video);
  ASSERT_EQ(recording->frames.size(), 3U);
  EXPECT_EQ(recording->frames[2].number, 10U);
  EXPECT_TRUE(recording->frames[2].file.empty());
}

TEST(FindRecording, RefusesAFolderWithSeveralRecordings) {
  const support::TemporaryFolder two_videos, mixed;
  two_videos.write("a.mkv", "");
  two_videos.write("b.mkv", "");
  mixed.write("a.mkv", "");
  mixed.write("1.pgm", "");

  for (const auto* folder : {&two_videos, &mixed}) {
    const auto recording = find_recording(folder->path(), "north", 60.0);
    ASSERT_FALSE(recording);
    EXPECT_EQ(recording.error().code, ErrorCode::InvalidArgument);
    EXPECT_THAT(recording.error().message, HasSubstr("more than one recording"));
  }
}

}  // namespace replay_recording_test
}  // namespace mocap::cameras
