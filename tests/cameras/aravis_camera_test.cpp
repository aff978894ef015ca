#include "cameras/aravis/aravis_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>

#include "cameras/camera_steps.h"
#include "cameras/fake_gige.h"
#include "cameras/own_network.h"

namespace mocap::cameras {
namespace aravis_camera_test {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

// A packet socket receives nothing on loopback.
AravisSettings at_address(const std::string& address) {
  AravisSettings settings;
  settings.address = address;
  settings.packet_socket = false;
  settings.width_px = 320;
  settings.height_px = 240;
  settings.rate_hz = 100.0;
  settings.packet_size_bytes = 9000;
  return settings;
}

AravisSettings with_serial(const std::string& serial) {
  AravisSettings settings = at_address("");
  settings.serial = serial;
  return settings;
}

double seconds_of(const std::function<void()>& what) {
  const Timestamp before = host_now();
  what();
  return to_s(host_now() - before);
}

// Limit of one call: a service that is terminated has 1 s, and a camera cannot know when.
constexpr double kAtOnce_s = 0.5;

// The tests have a network namespace of their own, so they find no other cameras and all ports are free.
class AravisCamera : public testing::Test {
 protected:
  void SetUp() override {
    static const std::string refusal = enter_own_network(3);
    if (!refusal.empty()) GTEST_SKIP() << refusal;
  }
};

TEST_F(AravisCamera, DeliversTheServedImagesByAddress) {
  FakeGigE fake("127.0.0.2", "T71001");
  ASSERT_TRUE(fake.running());
  StreamCounters counters;
  const auto camera = make_aravis_camera(CameraId{3}, "north", at_address("127.0.0.2"), &counters);

  const Status begun = started(*camera);
  ASSERT_TRUE(begun) << begun.error().message;
  std::uint64_t last_number = 0;
  Timestamp last_exposed;
  for (int i = 0; i < 20; ++i) {
    const std::optional<Frame> frame = whole_frame(*camera);

    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->camera, CameraId{3});
    EXPECT_EQ(frame->image.width_px, 320);
    EXPECT_EQ(frame->image.height_px, 240);
    EXPECT_EQ(frame->image.stride_bytes, 320U);
    ASSERT_EQ(frame->image.bytes.size(), 320U * 240U);
    EXPECT_EQ(frame->image.bytes.front(), static_cast<std::byte>(frame->number));
    EXPECT_EQ(frame->image.bytes.back(), static_cast<std::byte>(frame->number));
    EXPECT_GT(frame->number, last_number);
    EXPECT_GT(frame->exposed_at, last_exposed);
    EXPECT_LE(frame->exposed_at, frame->received_at);
    EXPECT_LE(frame->received_at, host_now());
    last_number = frame->number;
    last_exposed = frame->exposed_at;
  }
  EXPECT_GE(counters.completed_frames.load(), 20U);
}

TEST_F(AravisCamera, IsFoundByItsSerialNumber) {
  FakeGigE fake("127.0.0.1", "T71002");
  ASSERT_TRUE(fake.running());
  AravisSettings settings = at_address("");
  settings.serial = "T71002";
  const auto camera = make_aravis_camera(CameraId{0}, "north", settings);

  const Status begun = started(*camera);

  ASSERT_TRUE(begun) << begun.error().message;
  EXPECT_TRUE(whole_frame(*camera));
}

TEST_F(AravisCamera, NamesTheSerialNumbersThatItFoundIfItsOwnIsAbsent) {
  FakeGigE fake("127.0.0.1", "T71003");
  ASSERT_TRUE(fake.running());
  AravisSettings settings = at_address("");
  settings.serial = "DA1234567";
  const auto camera = make_aravis_camera(CameraId{0}, "north-east", settings);

  const Status begun = started(*camera);

  ASSERT_FALSE(begun);
  EXPECT_EQ(begun.error().code, ErrorCode::NotFound);
  EXPECT_THAT(begun.error().message, HasSubstr("camera 'north-east': no Aravis camera with serial DA1234567; found"));
  EXPECT_THAT(begun.error().message, HasSubstr("T71003"));
}

TEST_F(AravisCamera, StartReturnsAtOnceDuringTheSearchForAnAbsentSerialNumber) {
  FakeGigE fake("127.0.0.1", "T71016");
  ASSERT_TRUE(fake.running());
  const auto camera = make_aravis_camera(CameraId{0}, "north", with_serial("DA1234567"));

  Status first, later;
  const double first_s = seconds_of([&] { first = camera->start(); });
  camera->stop();  // as the daemon does between two attempts; the search continues
  for (int i = 0; i < 10 && (later || later.error().code == ErrorCode::Timeout); ++i) {
    EXPECT_LT(seconds_of([&] { later = camera->start(); }), kAtOnce_s);
  }

  EXPECT_LT(first_s, kAtOnce_s);
  ASSERT_FALSE(first);
  EXPECT_EQ(first.error().code, ErrorCode::Timeout);
  EXPECT_THAT(first.error().message, HasSubstr("camera 'north': still looking for"));
  ASSERT_FALSE(later);
  EXPECT_EQ(later.error().code, ErrorCode::NotFound);
  EXPECT_THAT(later.error().message, HasSubstr("no Aravis camera with serial DA1234567; found"));
  EXPECT_THAT(later.error().message, HasSubstr("T71016"));
}

TEST_F(AravisCamera, StartReturnsAtOnceDuringSeveralSearches) {
  FakeGigE fake("127.0.0.2", "T71017");
  ASSERT_TRUE(fake.running());
  AravisSettings named = at_address("");
  named.device_name = "nowhere";
  const auto by_serial = make_aravis_camera(CameraId{0}, "serial", with_serial("DA1234567"));
  const auto by_name = make_aravis_camera(CameraId{1}, "name", named);
  const auto by_address = make_aravis_camera(CameraId{2}, "address", at_address("127.0.0.4"));
  const auto there = make_aravis_camera(CameraId{3}, "there", at_address("127.0.0.2"));

  EXPECT_LT(seconds_of([&] { EXPECT_FALSE(by_serial->start()); }), kAtOnce_s);
  EXPECT_LT(seconds_of([&] { EXPECT_FALSE(by_name->start()); }), kAtOnce_s);
  EXPECT_LT(seconds_of([&] { EXPECT_FALSE(by_address->start()); }), kAtOnce_s);
  EXPECT_LT(seconds_of([&] { static_cast<void>(there->start()); }), kAtOnce_s);

  EXPECT_TRUE(started(*there));
  EXPECT_THAT(started(*by_serial).error().message, HasSubstr("no Aravis camera with serial DA1234567"));
  EXPECT_THAT(started(*by_name).error().message, HasSubstr("no Aravis camera named nowhere"));
  EXPECT_THAT(started(*by_address).error().message, HasSubstr("no Aravis camera answers at 127.0.0.4"));
}

TEST_F(AravisCamera, IsDestroyedAtOnceDuringASearchAndLeavesTheDeviceFree) {
  FakeGigE fake("127.0.0.1", "T71018");
  ASSERT_TRUE(fake.running());
  auto gone = make_aravis_camera(CameraId{0}, "gone", with_serial("T71018"));
  const Status looking = gone->start();  // a search takes about 1 s
  ASSERT_FALSE(looking);
  EXPECT_EQ(looking.error().code, ErrorCode::Timeout);

  EXPECT_LT(seconds_of([&] { gone.reset(); }), kAtOnce_s);

  // The abandoned attempt opens the camera and closes it again.
  const auto next = make_aravis_camera(CameraId{0}, "next", with_serial("T71018"));
  Status begun = started(*next);
  for (int i = 0; i < 10 && !begun && begun.error().code == ErrorCode::Busy; ++i) begun = started(*next);
  ASSERT_TRUE(begun) << begun.error().message;
  EXPECT_TRUE(whole_frame(*next));
}

TEST_F(AravisCamera, StartsWithTheExposureThatWasSetDuringItsSearch) {
  FakeGigE fake("127.0.0.1", "T71019");
  ASSERT_TRUE(fake.running());
  AravisSettings settings = with_serial("T71019");
  settings.exposure_us = 500.0;
  const auto camera = make_aravis_camera(CameraId{0}, "north", settings);
  const Status looking = camera->start();  // a search takes about 1 s
  ASSERT_FALSE(looking);
  ASSERT_EQ(looking.error().code, ErrorCode::Timeout);

  ASSERT_TRUE(camera->adjust({.exposure_us = 700.0}));
  testing::internal::CaptureStderr();
  Status begun = started(*camera);
  for (int i = 0; i < 10 && !begun && begun.error().code == ErrorCode::Busy; ++i) begun = started(*camera);
  const std::string log = testing::internal::GetCapturedStderr();

  ASSERT_TRUE(begun) << begun.error().message;
  EXPECT_THAT(log, HasSubstr("exposure=700us"));
  EXPECT_TRUE(whole_frame(*camera));
}

TEST_F(AravisCamera, ReportsThatNoCameraAnswersAtAnAddress) {
  const auto camera = make_aravis_camera(CameraId{0}, "north", at_address("127.0.0.4"));

  const Status begun = started(*camera);

  ASSERT_FALSE(begun);
  EXPECT_EQ(begun.error().code, ErrorCode::NotFound) << begun.error().message;
  EXPECT_THAT(begun.error().message, HasSubstr("127.0.0.4"));
}

TEST_F(AravisCamera, NamesThePixelFormatsThatTheCameraOffers) {
  FakeGigE fake("127.0.0.2", "T71004");
  ASSERT_TRUE(fake.running());
  AravisSettings settings = at_address("127.0.0.2");
  settings.pixel_format = "Mono14";
  const auto camera = make_aravis_camera(CameraId{0}, "north", settings);

  const Status begun = started(*camera);

  ASSERT_FALSE(begun);
  EXPECT_EQ(begun.error().code, ErrorCode::Unsupported);
  EXPECT_THAT(begun.error().message, HasSubstr("pixel_format Mono14 is refused"));
  EXPECT_THAT(begun.error().message, HasSubstr("Mono8"));
}

TEST_F(AravisCamera, RefusesAPixelFormatThatItCannotRead) {
  FakeGigE fake("127.0.0.2", "T71005");
  ASSERT_TRUE(fake.running());
  AravisSettings settings = at_address("127.0.0.2");
  settings.pixel_format = "RGB8";
  const auto camera = make_aravis_camera(CameraId{0}, "north", settings);

  const Status begun = started(*camera);

  ASSERT_FALSE(begun);
  EXPECT_EQ(begun.error().code, ErrorCode::Unsupported);
  EXPECT_THAT(begun.error().message, HasSubstr("use Mono8"));
}

TEST_F(AravisCamera, DeliversSixteenBitPixels) {
  FakeGigE fake("127.0.0.2", "T71006");
  ASSERT_TRUE(fake.running());
  AravisSettings settings = at_address("127.0.0.2");
  settings.pixel_format = "Mono16";
  const auto camera = make_aravis_camera(CameraId{0}, "north", settings);

  const Status begun = started(*camera);

  // A 16-bit format does not state how many bits are used, so it is not supported.
  ASSERT_FALSE(begun);
  EXPECT_EQ(begun.error().code, ErrorCode::Unsupported);
}

TEST_F(AravisCamera, NamesTheSizeOfTheSensorForARefusedRegion) {
  FakeGigE fake("127.0.0.2", "T71007");
  ASSERT_TRUE(fake.running());
  AravisSettings settings = at_address("127.0.0.2");
  settings.width_px = 100000;
  const auto camera = make_aravis_camera(CameraId{0}, "north", settings);

  const Status begun = started(*camera);

  ASSERT_FALSE(begun);
  EXPECT_EQ(begun.error().code, ErrorCode::InvalidArgument);
  EXPECT_THAT(begun.error().message, HasSubstr("region 100000x240"));
  EXPECT_THAT(begun.error().message, HasSubstr("sensor of 2048x2048"));
}

TEST_F(AravisCamera, NamesTheRangeOfARefusedExposure) {
  FakeGigE fake("127.0.0.2", "T71008");
  ASSERT_TRUE(fake.running());
  AravisSettings settings = at_address("127.0.0.2");
  settings.exposure_us = 1e12;
  const auto camera = make_aravis_camera(CameraId{0}, "north", settings);

  const Status begun = started(*camera);

  ASSERT_FALSE(begun);
  EXPECT_THAT(begun.error().message, HasSubstr("exposure_us"));
  EXPECT_THAT(begun.error().message, HasSubstr("expected 10 to"));
}

TEST_F(AravisCamera, RefusesATriggerThatTheCameraDoesNotHave) {
  FakeGigE fake("127.0.0.2", "T71009");
  ASSERT_TRUE(fake.running());
  AravisSettings settings = at_address("127.0.0.2");
  settings.trigger = "Line77";
  const auto camera = make_aravis_camera(CameraId{0}, "north", settings);

  const Status begun = started(*camera);

  ASSERT_FALSE(begun);
  EXPECT_THAT(begun.error().message, HasSubstr("trigger Line77 is refused"));
}

TEST_F(AravisCamera, ConvertsTheStampOfAUtcClockToTheMiddleOfTheExposure) {
  FakeGigE fake("127.0.0.2", "T71010");  // its stamp is the host's UTC when it starts to fill an image
  ASSERT_TRUE(fake.running());
  AravisSettings settings = at_address("127.0.0.2");
  settings.exposure_us = 4000.0;
  settings.clock = "utc";
  settings.stamps = "end";
  const auto by_end = make_aravis_camera(CameraId{0}, "north", settings);

  ASSERT_TRUE(started(*by_end));
  const std::optional<Frame> frame = whole_frame(*by_end);

  ASSERT_TRUE(frame);
  const Duration age = frame->received_at - frame->exposed_at;
  EXPECT_GE(age, milliseconds(2));  // half of the exposure, and the transfer
  EXPECT_LT(age, seconds(1));
}

TEST_F(AravisCamera, ReportsAnUnpluggedDeviceAsLostAndFindsItAgain) {
  std::optional<FakeGigE> fake;
  fake.emplace("127.0.0.2", "T71011");
  ASSERT_TRUE(fake->running());
  const auto camera = make_aravis_camera(CameraId{0}, "north", at_address("127.0.0.2"));
  ASSERT_TRUE(started(*camera));
  ASSERT_TRUE(whole_frame(*camera));

  fake.reset();
  const Timestamp unplugged = host_now();
  ErrorCode code = ErrorCode::Timeout;
  while (host_now() - unplugged < seconds(15) && code != ErrorCode::DeviceLost) {
    const Result<Frame> frame = camera->next(milliseconds(50));
    code = frame ? ErrorCode::Timeout : frame.error().code;
  }
  RecordProperty("lost_after_s", std::to_string(to_s(host_now() - unplugged)));
  ASSERT_EQ(code, ErrorCode::DeviceLost);
  EXPECT_EQ(camera->next(milliseconds(1)).error().code, ErrorCode::DeviceLost);  // the camera stays lost

  EXPECT_EQ(started(*camera).error().code, ErrorCode::NotFound);  // the camera is still absent
  fake.emplace("127.0.0.2", "T71011");
  ASSERT_TRUE(fake->running());
  const Status again = started(*camera);

  ASSERT_TRUE(again) << again.error().message;
  EXPECT_TRUE(whole_frame(*camera));
}

TEST_F(AravisCamera, IsBusyForASecondController) {
  FakeGigE fake("127.0.0.2", "T71012");
  ASSERT_TRUE(fake.running());
  const auto first = make_aravis_camera(CameraId{0}, "first", at_address("127.0.0.2"));
  const auto second = make_aravis_camera(CameraId{1}, "second", at_address("127.0.0.2"));
  ASSERT_TRUE(started(*first));

  const Status begun = started(*second);

  ASSERT_FALSE(begun);
  EXPECT_EQ(begun.error().code, ErrorCode::Busy) << begun.error().message;
  EXPECT_TRUE(whole_frame(*first));
}

TEST_F(AravisCamera, LeaksNothingOverFiftyStarts) {
  FakeGigE fake("127.0.0.2", "T71013");
  ASSERT_TRUE(fake.running());
  const auto camera = make_aravis_camera(CameraId{0}, "north", at_address("127.0.0.2"));
  const auto once = [&] {
    const Status begun = started(*camera);
    ASSERT_TRUE(begun) << begun.error().message;
    camera->stop();
  };
  once();
  const std::size_t files = entries("/proc/self/fd");
  const std::size_t running = entries("/proc/self/task");

  for (int i = 0; i < 50; ++i) once();

  const Timestamp end = host_now() + seconds(5);  // a thread that has delivered its result still has to end
  while (entries("/proc/self/task") > running && host_now() < end) {
  }
  EXPECT_LE(entries("/proc/self/fd"), files);
  EXPECT_LE(entries("/proc/self/task"), running);
}

TEST_F(AravisCamera, StopsSoonWhenTheDeviceIsSilent) {
  std::optional<FakeGigE> fake;
  fake.emplace("127.0.0.2", "T71015");
  ASSERT_TRUE(fake->running());
  const auto camera = make_aravis_camera(CameraId{0}, "north", at_address("127.0.0.2"));
  ASSERT_TRUE(started(*camera));
  ASSERT_TRUE(whole_frame(*camera));
  fake.reset();
  while (camera->next(milliseconds(200))) {
  }

  const Timestamp before = host_now();
  camera->stop();
  const Timestamp stopped = host_now();
  EXPECT_EQ(started(*camera).error().code, ErrorCode::NotFound);

  // A service that is terminated has 1 s; Aravis alone would take 12 s and 3.5 s.
  EXPECT_LT(to_s(stopped - before), 0.5);
  EXPECT_LT(to_s(host_now() - stopped), 0.8);
}

TEST_F(AravisCamera, IsHarmlessWhenNeverStarted) {
  const auto camera = make_aravis_camera(CameraId{0}, "north", at_address("127.0.0.2"));

  camera->stop();

  EXPECT_EQ(camera->next(milliseconds(1)).error().code, ErrorCode::DeviceLost);
}

}  // namespace aravis_camera_test
}  // namespace mocap::cameras
