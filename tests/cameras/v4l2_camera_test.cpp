#include "cameras/v4l2/v4l2_camera.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "cameras/v4l2/v4l2_discovery.h"

namespace mocap::cameras {
namespace v4l2_camera_test {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

V4l2Settings settings_for(const std::string& device) {
  V4l2Settings settings;
  settings.device = device;
  settings.width_px = 320;
  settings.height_px = 180;
  settings.rate_hz = 10.0;
  return settings;
}

TEST(V4l2Camera, ReportsAnAbsentDevice) {
  const auto camera = make_v4l2_camera(CameraId{0}, "north", settings_for("/dev/video-none"));

  const Status started = camera->start();

  EXPECT_EQ(started.error().code, ErrorCode::NotFound);
  EXPECT_EQ(started.error().message, "camera 'north': /dev/video-none: cannot open: No such file or directory");
}

TEST(V4l2Camera, RefusesAFileThatIsNoVideoDevice) {
  const auto camera = make_v4l2_camera(CameraId{0}, "north", settings_for("/dev/null"));

  const Status started = camera->start();

  EXPECT_EQ(started.error().code, ErrorCode::Unsupported);
  EXPECT_THAT(started.error().message, HasSubstr("camera 'north': /dev/null: VIDIOC_QUERYCAP failed"));
}

TEST(V4l2Camera, IsHarmlessWhenNeverStarted) {
  const auto camera = make_v4l2_camera(CameraId{0}, "north", settings_for("/dev/null"));

  camera->stop();

  EXPECT_EQ(camera->next(milliseconds(1)).error().code, ErrorCode::DeviceLost);
}

// Tests on the kernel's driver vivid, in the virtual machine of tests/system/guest_vm.sh.
class V4l2Vivid : public testing::Test {
 protected:
  void SetUp() override {
    const char* device = std::getenv("MOCAP_V4L2_DEVICE");
    if (device == nullptr) GTEST_SKIP() << "no vivid device; tests/system/guest_vm.sh runs this in a virtual machine";
    settings_ = settings_for(device);
  }

  // The next complete frame, or none within `patience`.
  static std::optional<Frame> whole_frame(Camera& camera, Duration patience = seconds(10)) {
    const Timestamp end = host_now() + patience;
    while (host_now() < end) {
      const Result<Frame> frame = camera.next(milliseconds(200));
      if (frame) return *frame;
      if (frame.error().code == ErrorCode::DeviceLost) return std::nullopt;
    }
    return std::nullopt;
  }

  // Sets a control by its name, as v4l2-ctl does. False if there is no such control.
  bool set_control(const std::string& name, int value) const {
    const int handle = open(settings_.device.c_str(), O_RDWR | O_CLOEXEC);
    v4l2_queryctrl control{};
    control.id = V4L2_CTRL_FLAG_NEXT_CTRL;
    bool done = false;
    for (; !done && ioctl(handle, VIDIOC_QUERYCTRL, &control) == 0; control.id |= V4L2_CTRL_FLAG_NEXT_CTRL) {
      if (name != reinterpret_cast<const char*>(control.name)) continue;
      v4l2_control set{control.id, value};
      done = ioctl(handle, VIDIOC_S_CTRL, &set) == 0;
    }
    close(handle);
    return done;
  }

  V4l2Settings settings_;
};

TEST_F(V4l2Vivid, DeliversEveryFormatOfTheDriver) {
  const struct {
    const char* name;
    PixelFormat format;
    std::size_t stride_bytes;
  } cases[] = {{"GREY", PixelFormat::Mono8, 320},
               {"Y10", PixelFormat::Mono10, 640},
               {"YUYV", PixelFormat::Yuyv, 640},
               {"NV12", PixelFormat::Nv12, 320}};
  for (const auto& each : cases) {
    settings_.pixel_format = each.name;
    StreamCounters counters;
    const auto camera = make_v4l2_camera(CameraId{1}, "north", settings_, &counters);

    const Status started = camera->start();
    ASSERT_TRUE(started) << started.error().message;
    const std::optional<Frame> first = whole_frame(*camera);
    ASSERT_TRUE(first) << each.name;
    const Frame before = *first;
    const std::optional<Frame> second = whole_frame(*camera);

    ASSERT_TRUE(second) << each.name;
    EXPECT_EQ(second->camera, CameraId{1});
    EXPECT_EQ(second->image.format, each.format);
    EXPECT_EQ(second->image.stride_bytes, each.stride_bytes);
    EXPECT_EQ(second->image.width_px, 320);
    EXPECT_EQ(second->image.height_px, 180);
    EXPECT_GE(second->image.bytes.size(), each.stride_bytes * 180);
    EXPECT_GT(second->number, before.number);
    EXPECT_GT(second->exposed_at, before.exposed_at);
    EXPECT_LE(second->exposed_at, second->received_at);
    EXPECT_GT(second->exposed_at, second->received_at - seconds(2));
    EXPECT_EQ(counters.completed_frames.load(), 2U);
  }
}

TEST_F(V4l2Vivid, TakesTheTimeOfReceiptFromAStampInTheFutureOn) {
  StreamCounters counters;
  const auto camera = make_v4l2_camera(CameraId{1}, "north", settings_, &counters);
  ASSERT_TRUE(camera->start());
  const Timestamp end = host_now() + seconds(60);

  // vivid delivers a frame at its begin, with the time of its end. A frame that is received late does not show it.
  while (counters.clock_source.load() != ClockSource::Receipts && host_now() < end) ASSERT_TRUE(whole_frame(*camera));

  EXPECT_EQ(counters.clock_source.load(), ClockSource::Receipts);
}

TEST_F(V4l2Vivid, UsesTheStampsOfADriverThatStampsTheStartOfTheExposure) {
  ASSERT_TRUE(set_control("Timestamp Source", 1));
  StreamCounters counters;
  const auto camera = make_v4l2_camera(CameraId{1}, "north", settings_, &counters);
  ASSERT_TRUE(camera->start());

  const std::optional<Frame> frame = whole_frame(*camera);

  ASSERT_TRUE(set_control("Timestamp Source", 0));
  ASSERT_TRUE(frame);
  EXPECT_LT(frame->exposed_at, frame->received_at);
  EXPECT_EQ(counters.clock_source.load(), ClockSource::Camera);
}

TEST_F(V4l2Vivid, StampsAtTheConfiguredRate) {
  const auto camera = make_v4l2_camera(CameraId{0}, "north", settings_);
  ASSERT_TRUE(camera->start());
  ASSERT_TRUE(whole_frame(*camera));  // the first frame is not periodic
  const std::optional<Frame> first = whole_frame(*camera);
  ASSERT_TRUE(first);
  const Frame begin = *first;
  Frame end = begin;

  for (int i = 0; i < 10; ++i) {
    const std::optional<Frame> frame = whole_frame(*camera);
    ASSERT_TRUE(frame);
    end = *frame;
  }

  const double period_s = to_s(end.exposed_at - begin.exposed_at) / static_cast<double>(end.number - begin.number);
  EXPECT_NEAR(period_s, 0.1, 0.03);  // an emulated processor is sometimes late
}

TEST_F(V4l2Vivid, NamesTheCallThatSelectedAnotherFormat) {
  settings_.pixel_format = "MJPEG";
  const Status no_jpeg = make_v4l2_camera(CameraId{0}, "north", settings_)->start();
  settings_.pixel_format = "GREY";
  settings_.width_px = 333;
  const Status no_size = make_v4l2_camera(CameraId{0}, "north", settings_)->start();
  settings_.width_px = 320;
  settings_.rate_hz = 7.3;
  const Status no_rate = make_v4l2_camera(CameraId{0}, "north", settings_)->start();

  EXPECT_EQ(no_jpeg.error().code, ErrorCode::Unsupported);
  EXPECT_THAT(no_jpeg.error().message, HasSubstr("for pixel_format MJPEG; the device offers "));
  EXPECT_THAT(no_jpeg.error().message, HasSubstr("GREY"));
  EXPECT_EQ(no_size.error().code, ErrorCode::Unsupported);
  EXPECT_THAT(no_size.error().message, HasSubstr("VIDIOC_S_FMT gave 320x180 for 333x180"));
  EXPECT_EQ(no_rate.error().code, ErrorCode::Unsupported);
  EXPECT_THAT(no_rate.error().message, HasSubstr("for rate_hz = 7.3"));
}

TEST_F(V4l2Vivid, SetsTheGainAndNamesItsRange) {
  settings_.gain = 42.0;
  const auto camera = make_v4l2_camera(CameraId{0}, "north", settings_);
  ASSERT_TRUE(camera->start());
  const int handle = open(settings_.device.c_str(), O_RDWR | O_CLOEXEC);
  v4l2_control gain{V4L2_CID_GAIN, 0};
  EXPECT_EQ(ioctl(handle, VIDIOC_G_CTRL, &gain), 0);
  close(handle);
  EXPECT_EQ(gain.value, 42);

  settings_.gain = 1e6;
  camera->stop();
  const Status refused = make_v4l2_camera(CameraId{0}, "north", settings_)->start();

  EXPECT_EQ(refused.error().code, ErrorCode::InvalidArgument);
  EXPECT_THAT(refused.error().message, HasSubstr("gain is 1000000 in the driver's unit, expected 0 to 255"));
}

TEST_F(V4l2Vivid, ReportsThatTheDeviceHasNoExposureControl) {
  settings_.exposure_us = 500.0;

  const Status refused = make_v4l2_camera(CameraId{0}, "north", settings_)->start();

  EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
  EXPECT_THAT(refused.error().message, HasSubstr("VIDIOC_QUERYCTRL failed"));
  EXPECT_THAT(refused.error().message, HasSubstr("exposure_us"));
}

TEST_F(V4l2Vivid, IsBusyForASecondReader) {
  const auto first = make_v4l2_camera(CameraId{0}, "first", settings_);
  const auto second = make_v4l2_camera(CameraId{1}, "second", settings_);
  ASSERT_TRUE(first->start());

  const Status started = second->start();

  EXPECT_EQ(started.error().code, ErrorCode::Busy);
  EXPECT_TRUE(whole_frame(*first));
}

TEST_F(V4l2Vivid, ReportsAFrameThatTheDriverMarksAsBroken) {
  StreamCounters counters;
  const auto camera = make_v4l2_camera(CameraId{0}, "north", settings_, &counters);
  ASSERT_TRUE(camera->start());
  ASSERT_TRUE(whole_frame(*camera));

  ASSERT_TRUE(set_control("Inject V4L2_BUF_FLAG_ERROR", 1));
  ErrorCode code = ErrorCode::Timeout;
  for (int i = 0; i < 50 && code != ErrorCode::Io; ++i) {
    const Result<Frame> frame = camera->next(milliseconds(200));
    code = frame ? ErrorCode::Timeout : frame.error().code;
  }

  EXPECT_EQ(code, ErrorCode::Io);
  EXPECT_EQ(counters.failed_frames.load(), 1U);
  EXPECT_TRUE(whole_frame(*camera));
}

TEST_F(V4l2Vivid, ShowsDroppedFramesAsGapsInTheirNumbers) {
  const auto camera = make_v4l2_camera(CameraId{0}, "north", settings_);
  ASSERT_TRUE(camera->start());
  ASSERT_TRUE(set_control("Percentage of Dropped Buffers", 60));
  const std::optional<Frame> first = whole_frame(*camera);
  ASSERT_TRUE(first);
  const std::uint64_t begin = first->number;

  std::uint64_t end = begin;
  for (int i = 0; i < 8; ++i) {
    const std::optional<Frame> frame = whole_frame(*camera);
    ASSERT_TRUE(frame);
    end = frame->number;
  }

  EXPECT_GT(end - begin, 8U);  // 8 of about 20 frames
  EXPECT_TRUE(set_control("Percentage of Dropped Buffers", 0));
}

TEST_F(V4l2Vivid, ReportsAnUnpluggedDeviceAsLostAndFindsItAgain) {
  const auto camera = make_v4l2_camera(CameraId{0}, "north", settings_);
  for (int turn = 0; turn < 3; ++turn) {
    const Status started = camera->start();
    ASSERT_TRUE(started) << started.error().message;
    ASSERT_TRUE(whole_frame(*camera));

    ASSERT_TRUE(set_control("Disconnect", 1));
    ErrorCode code = ErrorCode::Timeout;
    for (int i = 0; i < 50 && code != ErrorCode::DeviceLost; ++i) {
      const Result<Frame> frame = camera->next(milliseconds(100));
      code = frame ? ErrorCode::Timeout : frame.error().code;
    }

    EXPECT_EQ(code, ErrorCode::DeviceLost);
    camera->stop();  // the last close plugs vivid in again
  }
}

TEST_F(V4l2Vivid, IsFoundByItsBusUnderAnyNumber) {
  const std::vector<VideoNode> nodes = list_video_nodes();
  ASSERT_FALSE(nodes.empty());
  V4l2Settings settings = settings_;
  settings.device.clear();
  settings.bus = nodes[0].bus;
  const auto camera = make_v4l2_camera(CameraId{0}, "north", settings);
  ASSERT_TRUE(camera->start());
  EXPECT_TRUE(whole_frame(*camera));
  camera->stop();

  settings.bus = "usb-nowhere";
  const auto nowhere = make_v4l2_camera(CameraId{0}, "north", settings);
  const Status missing = nowhere->start();

  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().code, ErrorCode::NotFound);
  EXPECT_THAT(missing.error().message, HasSubstr("no video device with bus usb-nowhere; found"));
  EXPECT_THAT(missing.error().message, HasSubstr(nodes[0].bus));
}

TEST_F(V4l2Vivid, ReturnsAfterItsDriverWasUnloadedAndLoaded) {
  const char* const remove = std::getenv("MOCAP_VIVID_REMOVE");
  const char* const insert = std::getenv("MOCAP_VIVID_INSERT");
  if (remove == nullptr || insert == nullptr) GTEST_SKIP() << "no way to take the driver out";
  const auto camera = make_v4l2_camera(CameraId{0}, "north", settings_);
  const auto files = [] {
    using Iterator = std::filesystem::directory_iterator;
    return std::distance(Iterator("/proc/self/fd"), Iterator());
  };
  std::ptrdiff_t held = 0;
  for (int round = 0; round < 5; ++round) {
    const Timestamp begun = host_now();
    ASSERT_TRUE(camera->start()) << round;
    ASSERT_TRUE(whole_frame(*camera)) << round;
    RecordProperty("back_after_s", std::to_string(to_s(host_now() - begun)));
    camera->stop();  // a driver in use cannot be unloaded
    if (round == 0) held = files();
    ASSERT_EQ(std::system(remove), 0);
    const Status away = camera->start();
    ASSERT_FALSE(away);
    EXPECT_EQ(away.error().code, ErrorCode::NotFound);
    ASSERT_EQ(std::system(insert), 0);
  }
  EXPECT_LE(files(), held);
}

TEST_F(V4l2Vivid, LeaksNothingOverFiftyStarts) {
  const auto open_files = [] {
    using Iterator = std::filesystem::directory_iterator;
    return std::distance(Iterator("/proc/self/fd"), Iterator());
  };
  const auto camera = make_v4l2_camera(CameraId{0}, "north", settings_);
  const auto files = open_files();

  for (int i = 0; i < 50; ++i) {
    ASSERT_TRUE(camera->start());
    camera->stop();
  }

  EXPECT_EQ(open_files(), files);
}

}  // namespace v4l2_camera_test
}  // namespace mocap::cameras
