#include "take/take_camera.h"

#include <gmock/gmock.h>

#include "detect/delivered_blobs.h"
#include "model/image_bounds.h"
#include "support/temporary_folder.h"
#include "take/example_take.h"

namespace mocap::take {
namespace take_camera_test {

using ::testing::HasSubstr;

constexpr Duration kPatience = std::chrono::seconds(20);

class TakeCameraOfAnExample : public ::testing::Test {
 protected:
  void SetUp() override { ASSERT_NO_FATAL_FAILURE(record_example(path(), 30)); }

  std::filesystem::path path() const { return folder_.path() / "walk-3.mcap"; }
  std::unique_ptr<BlobCamera> camera(const std::string& name, double speed = 0.0, bool loop = false) const {
    return make_take_camera(CameraId{5}, name, {.file = path(), .speed = speed, .loop = loop});
  }

  support::TemporaryFolder folder_;
};

TEST_F(TakeCameraOfAnExample, GivesTheRecordedImages) {
  const auto camera = this->camera("camera1");
  const auto detector = detect::make_delivered_detector(*camera);
  const auto tracker = detect::make_delivered_tracker();
  ASSERT_TRUE(camera->start());

  for (std::uint64_t set = 0; set < 30; ++set) {
    const auto frame = camera->next(kPatience);
    ASSERT_TRUE(frame) << frame.error().message;
    BlobFrame seen = example_blobs(1, set);
    EXPECT_EQ(frame->camera, CameraId{5});
    EXPECT_EQ(frame->number, seen.number);
    EXPECT_EQ(frame->exposed_at, seen.exposed_at);
    EXPECT_EQ(frame->image.bytes.size(),
              static_cast<std::size_t>(frame->image.width_px) * static_cast<std::size_t>(frame->image.height_px));
    BlobFrame again = seen;
    again.blobs = detector->detect(frame->image).blobs;
    tracker->track(again);
    EXPECT_TRUE(is_same(seen, again)) << "blobs and their 2D tracks";
  }
  EXPECT_EQ(camera->next(kPatience).error().code, ErrorCode::EndOfStream);
}

TEST_F(TakeCameraOfAnExample, BeginsAgainWithIncreasingNumbersAndTimes) {
  const auto camera = this->camera("camera0", 0.0, true);
  ASSERT_TRUE(camera->start());
  Timestamp last = Timestamp::min();
  std::uint64_t number = 0;

  for (int image = 0; image < 95; ++image) {
    const auto frame = camera->next(kPatience);
    ASSERT_TRUE(frame) << frame.error().message;
    if (image > 0) {
      EXPECT_EQ(frame->number, number + 1);
      EXPECT_NEAR(static_cast<double>((frame->exposed_at - last).count()), kExamplePeriod_ns, 10.0);
    }
    number = frame->number;
    last = frame->exposed_at;
  }
}

TEST_F(TakeCameraOfAnExample, KeepsTheRecordedPace) {
  const auto camera = this->camera("camera0", 0.001);  // 8.3 s from image to image
  ASSERT_TRUE(camera->start());

  EXPECT_TRUE(camera->next(Duration(1000)));
  EXPECT_EQ(camera->next(Duration(1000)).error().code, ErrorCode::Timeout);
}

TEST_F(TakeCameraOfAnExample, NamesTheCamerasThatTheTakeHas) {
  const auto started = camera("north")->start();

  ASSERT_FALSE(started);
  EXPECT_EQ(started.error().code, ErrorCode::NotFound);
  EXPECT_THAT(started.error().message, HasSubstr("camera 'north'"));
  EXPECT_THAT(started.error().message, HasSubstr("camera0, camera1"));
}

TEST_F(TakeCameraOfAnExample, RefusesAnImageThatNoCameraHas) {
  TakeStart start = example_start();
  start.description.cameras[1].width_px = kMaxImageSide_px + 1;
  const auto large = folder_.path() / "large.mcap";
  auto writer = TakeWriter::create(large, start);
  ASSERT_TRUE(writer) << writer.error().message;
  ASSERT_TRUE((*writer)->finish(start.info));

  const auto started = make_take_camera(CameraId{5}, "camera1", {.file = large})->start();

  ASSERT_FALSE(started);
  EXPECT_THAT(started.error().message, HasSubstr("camera 'camera1' is 16385 x 1024 px large, expected at most 16384"));
}

TEST_F(TakeCameraOfAnExample, FailsWithoutItsFileAndBeforeItsStart) {
  std::filesystem::remove(path());
  const auto camera = this->camera("camera0");

  EXPECT_EQ(camera->start().error().code, ErrorCode::NotFound);
  EXPECT_EQ(camera->next(kPatience).error().code, ErrorCode::DeviceLost);
}

}  // namespace take_camera_test
}  // namespace mocap::take
