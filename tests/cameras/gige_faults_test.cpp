// The Aravis camera against the GigE Vision server of the simulator: faults of networks and cameras.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <malloc.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "cameras/aravis/aravis_camera.h"
#include "cameras/aravis/aravis_describe.h"
#include "cameras/aravis/aravis_ptp.h"
#include "cameras/camera_steps.h"
#include "cameras/clock/arrival_stamps.h"
#include "cameras/own_network.h"
#include "cameras/served_gige.h"

namespace mocap::cameras {
namespace gige_faults_test {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

AravisSettings at_address(const std::string& address) {
  AravisSettings settings;
  settings.address = address;
  settings.packet_socket = false;
  settings.packet_size_bytes = 1400;
  return settings;
}

class GigeFaults : public testing::Test {
 protected:
  void SetUp() override {
    static const std::string refusal = enter_own_network(3);
    if (!refusal.empty()) GTEST_SKIP() << refusal;
  }
};

TEST_F(GigeFaults, ReceivesEveryImageCompletelyAtOnePercentPacketLoss) {
  auto settings = ServedGigE::at("127.0.0.2", "G1");
  settings.lost_share = 0.01;
  ServedGigE served(settings);
  ASSERT_TRUE(served.running());
  StreamCounters counters;
  const auto camera = make_aravis_camera(CameraId{0}, "north", at_address("127.0.0.2"), &counters);
  ASSERT_TRUE(started(*camera));

  int whole = 0;
  std::uint64_t first = 0, last = 0;
  for (; whole < 300; ++whole) {
    const std::optional<Frame> frame = whole_frame(*camera);
    ASSERT_TRUE(frame) << whole;
    if (first == 0) first = frame->number;
    last = frame->number;
  }

  // An image has 57 packets: without resends 2 of 5 images would be broken. The first image may be incomplete because
  // its transfer began before start().
  EXPECT_GT(counters.resent_packets.load(), 50U);
  EXPECT_LE(counters.failed_frames.load(), 1U);
  EXPECT_LE(last - first + 1, 300U + 3U);
}

TEST_F(GigeFaults, ReportsBrokenImagesIfTheCameraDoesNotResend) {
  auto settings = ServedGigE::at("127.0.0.2", "G2");
  settings.lost_share = 0.02;
  settings.resends = false;
  ServedGigE served(settings);
  ASSERT_TRUE(served.running());
  StreamCounters counters;
  const auto camera = make_aravis_camera(CameraId{0}, "north", at_address("127.0.0.2"), &counters);
  ASSERT_TRUE(started(*camera));

  int broken = 0;
  for (int i = 0; i < 200 && broken < 5; ++i) {
    const Result<Frame> frame = camera->next(milliseconds(200));
    if (!frame && frame.error().code == ErrorCode::Io) ++broken;
  }

  EXPECT_GE(broken, 5);
  EXPECT_GT(counters.missing_packets.load(), 0U);
}

TEST_F(GigeFaults, DropsAnImageThatArrivesTwice) {
  ServedGigE served(ServedGigE::at("127.0.0.2", "G3"), {.repeat_every = 3});
  ASSERT_TRUE(served.running());
  StreamCounters counters;
  const auto camera = make_aravis_camera(CameraId{0}, "north", at_address("127.0.0.2"), &counters);
  ASSERT_TRUE(started(*camera));

  std::uint64_t last = 0;
  for (int i = 0; i < 60; ++i) {
    const std::optional<Frame> frame = whole_frame(*camera);
    ASSERT_TRUE(frame);
    EXPECT_GT(frame->number, last);
    EXPECT_EQ(static_cast<unsigned>(frame->image.bytes.front()), frame->number % 256);
    last = frame->number;
  }
}

TEST_F(GigeFaults, ShowsAMissingIdAsAGapInTheNumbers) {
  ServedGigE served(ServedGigE::at("127.0.0.2", "G4"), {.skip_every = 10});
  ASSERT_TRUE(served.running());
  const auto camera = make_aravis_camera(CameraId{0}, "north", at_address("127.0.0.2"));
  ASSERT_TRUE(started(*camera));

  std::uint64_t gaps = 0, last = 0;
  for (int i = 0; i < 60; ++i) {
    const std::optional<Frame> frame = whole_frame(*camera);
    ASSERT_TRUE(frame);
    if (last != 0 && frame->number > last + 1) ++gaps;
    EXPECT_NE(frame->number % 10, 0U);
    last = frame->number;
  }

  EXPECT_GE(gaps, 5U);
}

TEST_F(GigeFaults, TimesOutOnASilentCameraAndStreamsAfterARestart) {
  ServedGigE served(ServedGigE::at("127.0.0.2", "G5"), {.silent_after = 20});
  ASSERT_TRUE(served.running());
  const auto camera = make_aravis_camera(CameraId{0}, "north", at_address("127.0.0.2"));
  for (int round = 0; round < 2; ++round) {
    ASSERT_TRUE(started(*camera));
    ASSERT_TRUE(whole_frame(*camera));
    const Timestamp end = host_now() + seconds(5);
    Result<Frame> frame = camera->next(milliseconds(300));
    while (frame && host_now() < end) frame = camera->next(milliseconds(300));
    ASSERT_FALSE(frame);
    EXPECT_EQ(frame.error().code, ErrorCode::Timeout);
  }
}

TEST_F(GigeFaults, SetsAnyFeatureByNameInOrderAndRefusesUnknownOnes) {
  ServedGigE served("127.0.0.2", "G6");
  ASSERT_TRUE(served.running());
  AravisSettings settings = at_address("127.0.0.2");
  settings.features = {{"TriggerDelay", "17"}, {"TriggerSelector", "AcquisitionStart"}, {"PtpEnable", "true"}};
  {
    const auto camera = make_aravis_camera(CameraId{0}, "north", settings);
    const Status begun = started(*camera);
    ASSERT_TRUE(begun) << begun.error().message;
  }
  settings.features = {{"TriggerDelays", "17"}};
  const auto camera = make_aravis_camera(CameraId{0}, "north", settings);

  const Status refused = started(*camera);

  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::Unsupported);
  EXPECT_THAT(refused.error().message, HasSubstr("no feature TriggerDelays"));
}

TEST_F(GigeFaults, DescribesTheFeaturesOfACameraWithTheirValues) {
  ServedGigE served("127.0.0.2", "G7");
  ASSERT_TRUE(served.running());

  const auto features = describe_aravis_camera(at_address("127.0.0.2"));

  ASSERT_TRUE(features) << features.error().message;
  const auto width = std::find_if(features->begin(), features->end(), [](const auto& f) { return f.name == "Width"; });
  ASSERT_NE(width, features->end());
  EXPECT_EQ(width->value, "320");
  EXPECT_EQ(width->range, "1 to 320");
  EXPECT_EQ(width->category, "ImageFormatControl");
}

TEST_F(GigeFaults, EnablesPtpAndWaitsForTheRole) {
  ServedGigE served("127.0.0.2", "G8");
  ASSERT_TRUE(served.running());
  AravisSettings settings = at_address("127.0.0.2");
  settings.ptp = true;
  testing::internal::CaptureStderr();
  const auto camera = make_aravis_camera(CameraId{0}, "north", settings);

  const Status begun = started(*camera);

  const std::string log = testing::internal::GetCapturedStderr();
  ASSERT_TRUE(begun) << begun.error().message;
  EXPECT_THAT(log, HasSubstr("G8 keeps PTP time: role=Slave"));
}

TEST(PtpWatch, LogsWhenTheClockFailsAndWhenItRecoversAndNothingBetween) {
  PtpWatch watch;
  const PtpState well{.enabled = true, .role = "Slave", .offset = std::chrono::nanoseconds(-800)};
  PtpState far = well;
  far.offset = milliseconds(-3);
  const PtpState listening{.enabled = true, .role = "Listening", .offset = {}};

  EXPECT_FALSE(watch.follow(well));
  EXPECT_THAT(watch.follow(far).value_or(""), HasSubstr("off its master's by -3000.000us, expected within 100us"));
  EXPECT_FALSE(watch.follow(far));
  EXPECT_FALSE(watch.is_well());
  EXPECT_THAT(watch.follow(well).value_or(""), HasSubstr("keeps PTP time again: role=Slave"));
  EXPECT_THAT(watch.follow(listening).value_or(""), HasSubstr("role=Listening, expected Slave or Master"));
  EXPECT_FALSE(watch.is_well());
}

TEST_F(GigeFaults, ReportsTheFirstArrivalOfALeaderAndNoOtherPacket) {
  in_addr camera{};
  inet_pton(AF_INET, "127.0.0.3", &camera);
  const auto stamps = ArrivalStamps::open(camera, 5005);
  if (!stamps) GTEST_SKIP() << "no packet sockets here (CAP_NET_RAW)";
  const int from = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in name{};
  name.sin_family = AF_INET;
  name.sin_addr = camera;
  ASSERT_EQ(bind(from, reinterpret_cast<const sockaddr*>(&name), sizeof name), 0);
  const auto send_to = [&](std::uint16_t port, std::uint8_t content, std::uint16_t id, bool extended) {
    std::array<std::uint8_t, 60> packet{};
    packet[4] = static_cast<std::uint8_t>(content | (extended ? 0x80 : 0));
    const std::size_t at = extended ? 14 : 2;
    packet[at] = static_cast<std::uint8_t>(id >> 8);
    packet[at + 1] = static_cast<std::uint8_t>(id);
    name.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    name.sin_port = htons(port);
    sendto(from, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&name), sizeof name);
  };
  const auto utc_now = [] { return host_now().time_since_epoch() + utc_minus_host(); };

  const Duration before = utc_now();
  send_to(5005, 1, 700, false);
  send_to(5005, 1, 701, true);
  send_to(5005, 3, 702, false);  // payload
  send_to(5006, 1, 703, false);  // another stream
  const Duration after = utc_now();
  const auto first = stamps->arrival_utc(700);
  send_to(5005, 1, 700, false);  // sent again
  close(from);

  ASSERT_TRUE(first);
  EXPECT_GT(*first, before - milliseconds(1));  // two reads of two clocks
  EXPECT_LT(*first, after + milliseconds(1));
  EXPECT_TRUE(stamps->arrival_utc(701));
  EXPECT_TRUE(stamps->arrival_utc((std::uint64_t{5} << 32) + 701)) << "of a long id the low bits count";
  EXPECT_FALSE(stamps->arrival_utc(702));
  EXPECT_FALSE(stamps->arrival_utc(703));
  EXPECT_EQ(stamps->arrival_utc(700), first);
}

TEST_F(GigeFaults, TakesAnImageForEachSoftwareTrigger) {
  ServedGigE served("127.0.0.2", "G14");
  ASSERT_TRUE(served.running());
  AravisSettings settings = at_address("127.0.0.2");
  settings.trigger = "software";
  const auto camera = make_aravis_camera(CameraId{0}, "north", settings);
  ASSERT_TRUE(started(*camera));

  for (int i = 0; i < 20; ++i) ASSERT_TRUE(whole_frame(*camera)) << i;

  // next() sends one trigger for each image, and no other function does.
  EXPECT_LE(served.sent(), 20U);
}

TEST_F(GigeFaults, DoesNotTriggerAgainForAnImageThatWaitsForItsCaller) {
  ServedGigE served("127.0.0.2", "G16");
  ASSERT_TRUE(served.running());
  AravisSettings settings = at_address("127.0.0.2");
  settings.trigger = "software";
  const auto camera = make_aravis_camera(CameraId{0}, "north", settings);
  ASSERT_TRUE(started(*camera));
  const Result<Frame> too_early = camera->next(Duration::zero());  // an image only if the machine stalls this thread

  // The caller is busy for longer than the image of a trigger is waited for, 0.4 s and the exposure.
  const Timestamp late = host_now() + milliseconds(1200);
  while (host_now() < late || served.sent() == 0) std::this_thread::sleep_for(milliseconds(10));
  const std::optional<Frame> frame = whole_frame(*camera);

  EXPECT_TRUE(frame);
  EXPECT_FALSE(served.device().take_software_trigger()) << "a second trigger is pending";
  EXPECT_EQ(served.sent(), too_early ? 2U : 1U);
}

TEST_F(GigeFaults, TriggersAgainIfAnImageOfASoftwareTriggerNeverComes) {
  ServedGigE served(ServedGigE::at("127.0.0.2", "G15"), {.skip_every = 3});
  ASSERT_TRUE(served.running());
  AravisSettings settings = at_address("127.0.0.2");
  settings.trigger = "software";
  const auto camera = make_aravis_camera(CameraId{0}, "north", settings);
  ASSERT_TRUE(started(*camera));

  for (int i = 0; i < 5; ++i) ASSERT_TRUE(whole_frame(*camera)) << i;
}

TEST_F(GigeFaults, RefusesAnExposureThatIsLongerThanThePeriod) {
  ServedGigE served("127.0.0.2", "G9");
  ASSERT_TRUE(served.running());
  AravisSettings settings = at_address("127.0.0.2");
  settings.rate_hz = 100.0;
  settings.exposure_us = 15000.0;
  const auto camera = make_aravis_camera(CameraId{0}, "north", settings);

  const Status refused = started(*camera);

  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, ErrorCode::InvalidArgument);
  EXPECT_THAT(refused.error().message, HasSubstr("longer than the period of 10000 us"));
}

TEST_F(GigeFaults, DeliversPackedFormatsInTheirOwnSize) {
  struct Case {
    const char* name;
    PixelFormat format;
    std::size_t bytes;
  };
  for (const Case& each :
       {Case{"Mono10p", PixelFormat::Mono10p, 96000}, Case{"Mono12p", PixelFormat::Mono12p, 115200},
        Case{"Mono12Packed", PixelFormat::Mono12Packed, 115200}, Case{"Mono12", PixelFormat::Mono12, 153600},
        Case{"BayerRG8", PixelFormat::BayerRg8, 76800}}) {
    ServedGigE served("127.0.0.2", "G10");
    ASSERT_TRUE(served.running());
    AravisSettings settings = at_address("127.0.0.2");
    settings.pixel_format = each.name;
    const auto camera = make_aravis_camera(CameraId{0}, "north", settings);

    const Status begun = started(*camera);
    ASSERT_TRUE(begun) << begun.error().message;
    const std::optional<Frame> frame = whole_frame(*camera);

    ASSERT_TRUE(frame) << each.name;
    EXPECT_EQ(frame->image.format, each.format) << each.name;
    EXPECT_EQ(frame->image.bytes.size(), each.bytes) << each.name;
  }
}

TEST_F(GigeFaults, NegotiatesThePacketSizeByTestPackets) {
  ServedGigE served("127.0.0.2", "G11");
  ASSERT_TRUE(served.running());
  AravisSettings settings = at_address("127.0.0.2");
  settings.packet_size_bytes.reset();
  const auto camera = make_aravis_camera(CameraId{0}, "north", settings);

  ASSERT_TRUE(started(*camera));

  EXPECT_TRUE(whole_frame(*camera));
}

// Bytes allocated and not freed, of all heaps. Meaningless under a sanitizer.
std::size_t memory_in_use() { return mallinfo2().uordblks + mallinfo2().hblkhd; }

TEST_F(GigeFaults, ReconnectsTenTimesWithoutLeaks) {
  const auto camera = make_aravis_camera(CameraId{0}, "north", at_address("127.0.0.2"));
  std::size_t files = 0, running = 0, taken = 0;
  for (int round = 0; round < 10; ++round) {
    ServedGigE served("127.0.0.2", "G12");
    ASSERT_TRUE(served.running());
    const Status begun = started(*camera);
    ASSERT_TRUE(begun) << round << ": " << begun.error().message;
    ASSERT_TRUE(whole_frame(*camera)) << round;
    camera->stop();
    if (round == 1) {
      files = entries("/proc/self/fd");
      running = entries("/proc/self/task");
      taken = memory_in_use();
    }
  }

  const Timestamp end = host_now() + seconds(5);
  while (entries("/proc/self/task") > running && host_now() < end) {
  }
  EXPECT_LE(entries("/proc/self/fd"), files);
  EXPECT_LE(entries("/proc/self/task"), running);
  // A camera's feature description takes 200 kB, an image 77 kB; GLib caches some small blocks.
  EXPECT_LT(memory_in_use(), taken + 64 * 1024);
}

}  // namespace gige_faults_test
}  // namespace mocap::cameras
