#include "take/recordings/blob_recording.h"

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <random>

#include "support/file_size_limit.h"
#include "support/temporary_folder.h"

namespace mocap::take {
namespace blob_recording_test {

using ::testing::HasSubstr;

const std::vector<RecordedCamera> kCameras{{"north", 1280, 1024}, {"door \"2\"", 640, 480}};

BlobFrame some_frame(std::mt19937& random, std::uint32_t camera, std::uint64_t number) {
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  BlobFrame frame;
  frame.camera = CameraId{camera};
  frame.number = number;
  frame.exposed_at = from_ns(1'000'000'000 + static_cast<std::int64_t>(number) * 16'666'667 + camera);
  for (std::uint64_t i = 0; i < number % 7; ++i) {
    Blob blob;
    blob.centroid.v = {1280.0 * unit(random), 1024.0 * unit(random)};
    blob.sigma_px = 0.01 + unit(random);
    blob.area_px2 = 40.0 * unit(random);
    blob.peak = unit(random);
    blob.roundness = unit(random);
    if (i % 2 == 0) blob.axis_rad = unit(random);
    blob.saturated = unit(random);
    blob.touches_border = i % 3 == 0;
    blob.merged = i % 4 == 0;
    frame.blobs.push_back(blob);
  }
  return frame;
}

class BlobRecordingTest : public ::testing::Test {
 protected:
  std::filesystem::path path() const { return folder_.path() / "take.blobs"; }

  std::vector<BlobFrame> record(int pictures) {
    std::mt19937 random(7);
    std::vector<BlobFrame> frames;
    auto writer = make_blob_writer(path(), kCameras);
    EXPECT_TRUE(writer);
    for (int i = 0; i < pictures; ++i) {
      frames.push_back(some_frame(random, static_cast<std::uint32_t>(i % 2), static_cast<std::uint64_t>(i / 2)));
      EXPECT_TRUE((*writer)->write(frames.back()));
    }
    EXPECT_TRUE((*writer)->finish());
    return frames;
  }
  std::string bytes() const {
    std::ifstream in(path(), std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  support::TemporaryFolder folder_;
};

TEST_F(BlobRecordingTest, RoundTripsFrames) {
  const auto frames = record(60);

  const auto read = read_blob_recording(path());

  ASSERT_TRUE(read) << read.error().message;
  EXPECT_FALSE(read->cut_off);
  ASSERT_EQ(read->cameras.size(), 2U);
  EXPECT_EQ(read->cameras[1].name, "door \"2\"");
  EXPECT_EQ(read->cameras[0].height_px, 1024);
  std::array<std::size_t, 2> next{};
  for (const BlobFrame& frame : frames) {
    const RecordedPicture& picture = read->pictures[frame.camera.value][next[frame.camera.value]++];
    EXPECT_EQ(picture.number, frame.number);
    EXPECT_EQ(picture.exposed_at, frame.exposed_at);
    ASSERT_EQ(picture.blobs.size(), frame.blobs.size());
    for (std::size_t i = 0; i < frame.blobs.size(); ++i) {
      EXPECT_EQ(picture.blobs[i].centroid.v, frame.blobs[i].centroid.v);
      EXPECT_FLOAT_EQ(static_cast<float>(picture.blobs[i].sigma_px), static_cast<float>(frame.blobs[i].sigma_px));
      EXPECT_EQ(std::isnan(picture.blobs[i].axis_rad), std::isnan(frame.blobs[i].axis_rad));
      EXPECT_EQ(picture.blobs[i].touches_border, frame.blobs[i].touches_border);
      EXPECT_EQ(picture.blobs[i].merged, frame.blobs[i].merged);
    }
  }
}

TEST_F(BlobRecordingTest, ReadsATruncatedFileUpToItsEnd) {
  record(60);
  const std::string whole = bytes();
  const auto all = read_blob_recording(path());
  ASSERT_TRUE(all);
  std::ofstream(path(), std::ios::binary) << whole.substr(0, whole.size() - 5);

  const auto read = read_blob_recording(path());

  ASSERT_TRUE(read) << read.error().message;
  EXPECT_TRUE(read->cut_off);
  EXPECT_EQ(read->pictures[0].size() + read->pictures[1].size() + 1, all->pictures[0].size() + all->pictures[1].size());
}

TEST_F(BlobRecordingTest, EndsWithTheLastWholeImageOnAFullDisk) {
  std::mt19937 random(5);
  auto writer = make_blob_writer(path(), kCameras);
  ASSERT_TRUE(writer);
  Status written;
  {
    const support::FileSizeLimit full_disk(100'000);
    for (std::uint64_t i = 0; i < 5000 && written; ++i) written = (*writer)->write(some_frame(random, 0, i));
  }

  const auto read = read_blob_recording(path());

  ASSERT_FALSE(written);
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_FALSE(read->cut_off);
  EXPECT_GT(read->pictures[0].size(), 100U);
  EXPECT_EQ(read->pictures[0].size(), (*writer)->size().records);
  EXPECT_EQ(std::filesystem::file_size(path()), (*writer)->size().bytes);
}

TEST_F(BlobRecordingTest, KeepsAnExistingRecording) {
  record(60);
  const std::string first = bytes();
  record(4);

  EXPECT_EQ(bytes(), first);
  const auto second = read_blob_recording(folder_.path() / "take-2.blobs");
  ASSERT_TRUE(second) << second.error().message;
  EXPECT_EQ(second->pictures[0].size() + second->pictures[1].size(), 4U);
}

TEST_F(BlobRecordingTest, RejectsDamagedRecords) {
  record(40);
  const std::string whole = bytes();
  std::mt19937 random(3);
  std::size_t refused = 0;
  for (int i = 0; i < 2000; ++i) {
    std::string broken = whole;
    for (int flips = 0; flips < 3; ++flips) broken[random() % broken.size()] = static_cast<char>(random());
    std::ofstream(path(), std::ios::binary | std::ios::trunc) << broken;

    const auto read = read_blob_recording(path());

    if (!read) {
      ++refused;
      EXPECT_FALSE(read.error().message.empty());
      continue;
    }
    for (const auto& pictures : read->pictures) {
      for (const RecordedPicture& picture : pictures) {
        for (const Blob& blob : picture.blobs) {
          EXPECT_TRUE(blob.centroid.v.allFinite());
          EXPECT_GT(blob.sigma_px, 0.0);
        }
      }
    }
  }
  EXPECT_GT(refused, 100U);
}

TEST_F(BlobRecordingTest, RejectsImagesThatAreNotLaterThanTheOneBefore) {
  std::mt19937 random(1);
  {
    auto writer = make_blob_writer(path(), kCameras);
    ASSERT_TRUE(writer);
    ASSERT_TRUE((*writer)->write(some_frame(random, 0, 2)));
    ASSERT_TRUE((*writer)->write(some_frame(random, 0, 1)));
    ASSERT_TRUE((*writer)->finish());
  }

  const auto read = read_blob_recording(path());

  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, HasSubstr("camera 'north' that is not later than the one before"));
}

TEST_F(BlobRecordingTest, RejectsImagesLargerThanThoseOfACamera) {
  for (const int width_px : {16384, 16385}) {
    std::filesystem::remove(path());
    auto writer = make_blob_writer(path(), std::vector<RecordedCamera>{{"north", width_px, 1024}});
    ASSERT_TRUE(writer);
    ASSERT_TRUE((*writer)->finish());

    EXPECT_EQ(static_cast<bool>(read_blob_recording(path())), width_px == 16384) << width_px;
  }
}

TEST_F(BlobRecordingTest, RequiresTheExtensionBlobs) {
  const auto writer = make_blob_writer(folder_.path() / "take.csv", kCameras);

  ASSERT_FALSE(writer);
  EXPECT_THAT(writer.error().message, HasSubstr("expected .blobs"));
}

}  // namespace blob_recording_test
}  // namespace mocap::take
