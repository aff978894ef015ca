// The Aravis camera against the GigE Vision server of the simulator: chunk data and action commands.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "cameras/aravis/aravis_camera.h"
#include "cameras/camera_steps.h"
#include "cameras/own_network.h"
#include "cameras/served_gige.h"

namespace mocap::cameras {
namespace gige_chunks_test {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::HasSubstr;

AravisSettings at_address(const std::string& address) {
  AravisSettings settings;
  settings.address = address;
  settings.packet_socket = false;
  settings.packet_size_bytes = 1400;
  settings.clock = "utc";
  return settings;
}

Duration middle_of(std::vector<Duration> all) {
  std::ranges::nth_element(all, all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2));
  return all[all.size() / 2];
}

class GigeExposures : public testing::Test {
 protected:
  void SetUp() override {
    static const std::string refusal = enter_own_network(3);
    if (!refusal.empty()) GTEST_SKIP() << refusal;
  }
};

TEST_F(GigeExposures, TakesBeginAndLengthOfEachExposureFromTheImage) {
  ServedGigE served(ServedGigE::at("127.0.0.2", "C1"), {.varies = true, .leader_late = milliseconds(-3)});
  ASSERT_TRUE(served.running());
  StreamCounters counters;
  const auto camera = make_aravis_camera(CameraId{0}, "north", at_address("127.0.0.2"), &counters);
  testing::internal::CaptureStderr();
  ASSERT_TRUE(started(*camera));
  EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("chunks=Timestamp, ExposureTime"));

  std::vector<Duration> off;
  for (int i = 0; i < 60; ++i) {
    const std::optional<Frame> frame = whole_frame(*camera);
    ASSERT_TRUE(frame);
    const auto middle = served.began_utc(frame->number) + from_s(0.5e-6 * ServedGigE::varied_us(frame->number));
    off.push_back(std::chrono::abs(frame->exposed_at.time_since_epoch() + utc_minus_host() - middle));
    EXPECT_EQ(frame->image.bytes.size(), 320U * 240U);
  }

  // The bound covers two reads of two clocks. An error would be larger: the leader is 3 ms early, exposures differ by
  // 1.6 ms.
  EXPECT_LT(middle_of(off), microseconds(50));
  EXPECT_TRUE(counters.chunk_times.load());
  EXPECT_EQ(counters.clock_source.load(), ClockSource::Camera);
}

TEST_F(GigeExposures, UsesTheStampOfTheLeaderIfChunksAreOff) {
  ServedGigE served(ServedGigE::at("127.0.0.2", "C2"), {.leader_late = milliseconds(-3)});
  ASSERT_TRUE(served.running());
  AravisSettings settings = at_address("127.0.0.2");
  for (const bool wanted : {true, false}) {  // the second camera has chunks enabled by the first run
    settings.chunks = wanted;
    StreamCounters counters;
    const auto camera = make_aravis_camera(CameraId{0}, "north", settings, &counters);
    ASSERT_TRUE(started(*camera));

    std::vector<Duration> early;
    for (int i = 0; i < 15; ++i) {
      const std::optional<Frame> frame = whole_frame(*camera);
      ASSERT_TRUE(frame);
      const Duration begin = frame->exposed_at.time_since_epoch() + utc_minus_host() - microseconds(250);
      early.push_back(served.began_utc(frame->number) - begin);
    }

    EXPECT_EQ(counters.chunk_times.load(), wanted);
    EXPECT_GT(middle_of(early), wanted ? -milliseconds(1) : milliseconds(2));
    EXPECT_LT(middle_of(early), wanted ? milliseconds(1) : milliseconds(4));
  }
}

TEST_F(GigeExposures, ReadsTheChunksOfImagesWithResentPackets) {
  auto settings = ServedGigE::at("127.0.0.2", "C3");
  settings.lost_share = 0.02;
  ServedGigE served(settings, {.varies = true, .leader_late = milliseconds(-3)});
  ASSERT_TRUE(served.running());
  StreamCounters counters;
  const auto camera = make_aravis_camera(CameraId{0}, "north", at_address("127.0.0.2"), &counters);
  ASSERT_TRUE(started(*camera));

  std::vector<Duration> off;
  for (int i = 0; i < 100; ++i) {
    const std::optional<Frame> frame = whole_frame(*camera);
    ASSERT_TRUE(frame);
    const auto middle = served.began_utc(frame->number) + from_s(0.5e-6 * ServedGigE::varied_us(frame->number));
    off.push_back(std::chrono::abs(frame->exposed_at.time_since_epoch() + utc_minus_host() - middle));
  }

  EXPECT_LT(middle_of(off), microseconds(50));
  EXPECT_GT(counters.resent_packets.load(), 20U);
}

TEST_F(GigeExposures, EstimatesFromTheReceiptsWhenTheCameraLosesItsMaster) {
  auto simulated = ServedGigE::at("127.0.0.2", "C4");
  simulated.clock_drift_ppm = -100.0;  // negative: a clock that is ahead would be rejected for stamps in the future
  ServedGigE served(simulated);
  ASSERT_TRUE(served.running());
  AravisSettings settings = at_address("127.0.0.2");
  settings.ptp = true;
  StreamCounters counters;
  const auto camera = make_aravis_camera(CameraId{0}, "north", settings, &counters);
  ASSERT_TRUE(started(*camera));
  ASSERT_TRUE(whole_frame(*camera));
  EXPECT_EQ(counters.clock_source.load(), ClockSource::Camera);

  served.device().lose_ptp();
  const Timestamp end = host_now() + seconds(60);
  while (counters.clock_source.load() == ClockSource::Camera && host_now() < end) ASSERT_TRUE(whole_frame(*camera));

  EXPECT_EQ(counters.clock_source.load(), ClockSource::Lost);
}

/// Three cameras, each on its own thread as in the daemon, with the true and the reported time of each exposure.
class Together {
 public:
  Together(const AravisSettings& common, double skew_us) {
    for (std::size_t i = 0; i < served_.size(); ++i) {
      const std::string address = "127.0.0." + std::to_string(2 + i);
      auto settings = ServedGigE::at(address, "A" + std::to_string(i));
      settings.clock_skew_us = skew_us * (static_cast<double>(i) - 1.0);
      served_[i] = std::make_unique<ServedGigE>(settings);
      threads_.emplace_back([this, i, common, address] {
        AravisSettings own = common;
        own.address = address;
        const auto camera = make_aravis_camera(CameraId{0}, "camera" + std::to_string(i), own);
        if (const Status begun = started(*camera); !begun) {
          refusals_[i] = begun.error().message;
          return;
        }
        for (int taken = 0; taken < kImages; ++taken) {
          const std::optional<Frame> frame = whole_frame(*camera, seconds(20));
          if (!frame) return;
          exposed_[i].push_back({served_[i]->began_utc(frame->number), frame->exposed_at});
        }
      });
    }
  }
  ~Together() { wait(); }
  Together(const Together&) = delete;
  Together& operator=(const Together&) = delete;

  void wait() {
    for (std::thread& each : threads_) {
      if (each.joinable()) each.join();
    }
  }

  static constexpr int kImages = 40;
  struct Exposed {
    Duration truth_utc;
    Timestamp reported;
  };
  const std::vector<Exposed>& exposed(std::size_t camera) const { return exposed_[camera]; }
  const std::string& refusal(std::size_t camera) const { return refusals_[camera]; }

 private:
  std::array<std::unique_ptr<ServedGigE>, 3> served_;
  std::array<std::vector<Exposed>, 3> exposed_;
  std::array<std::string, 3> refusals_;
  std::vector<std::thread> threads_;
};

TEST_F(GigeExposures, CamerasWithPtpExposeAtOneInstantByActionCommands) {
  AravisSettings settings = at_address("");
  settings.trigger = "action";
  settings.rate_hz = 50.0;
  settings.ptp = true;
  Together cameras(settings, 5000.0);
  cameras.wait();

  for (std::size_t i = 0; i < 3; ++i) {
    ASSERT_EQ(cameras.exposed(i).size(), std::size_t{Together::kImages}) << cameras.refusal(i);
    int late = 0;
    std::vector<Duration> off;
    for (const auto& [truth_utc, reported] : cameras.exposed(i)) {
      if (truth_utc % milliseconds(20) != Duration::zero()) ++late;
      off.push_back(std::chrono::abs(reported.time_since_epoch() + utc_minus_host() - truth_utc - microseconds(250)));
    }
    EXPECT_LT(late, Together::kImages);  // without commands all; a few if a busy host delays a thread by 0.1 s
    EXPECT_LT(middle_of(off), microseconds(50));
  }
}

TEST_F(GigeExposures, ACameraThatLosesItsMasterGetsImmediateCommands) {
  ServedGigE served("127.0.0.2", "C8");
  ASSERT_TRUE(served.running());
  AravisSettings settings = at_address("127.0.0.2");
  settings.trigger = "action";
  settings.rate_hz = 50.0;
  settings.ptp = true;
  StreamCounters counters;
  const auto camera = make_aravis_camera(CameraId{0}, "north", settings, &counters);
  ASSERT_TRUE(started(*camera));
  for (int i = 0; i < 20; ++i) ASSERT_TRUE(whole_frame(*camera));
  EXPECT_EQ(counters.clock_source.load(), ClockSource::Camera);

  served.device().lose_ptp();
  std::vector<Duration> exposed;
  for (int i = 0; i < 60; ++i) {
    const std::optional<Frame> frame = whole_frame(*camera);
    ASSERT_TRUE(frame) << i;
    exposed.push_back(served.began_utc(frame->number));
  }

  EXPECT_EQ(counters.clock_source.load(), ClockSource::Lost);
  for (std::size_t i = 1; i < exposed.size(); ++i) {
    EXPECT_GT(exposed[i] - exposed[i - 1], milliseconds(2)) << i;  // no exposure is commanded twice
  }
}

TEST_F(GigeExposures, CamerasWithoutPtpGetImmediateCommands) {
  AravisSettings settings = at_address("");
  settings.trigger = "action";
  settings.rate_hz = 50.0;
  settings.clock = "estimated";
  Together cameras(settings, 5000.0);
  cameras.wait();

  for (std::size_t i = 0; i < 3; ++i) {
    ASSERT_EQ(cameras.exposed(i).size(), std::size_t{Together::kImages}) << cameras.refusal(i);
    const auto on_beat = std::ranges::count_if(cameras.exposed(i), [](const Together::Exposed& each) {
      return std::chrono::abs((each.truth_utc + milliseconds(10)) % milliseconds(20) - milliseconds(10)) <
             milliseconds(1);
    });
    EXPECT_GE(on_beat, Together::kImages /
                           4);  // by chance a tenth; with commands all except where a busy host wakes a thread late
  }
}

TEST(GigeActions, AcceptsCommandsThatMatchItsKeysAndItsClock) {
  using Answer = sim::GigeActions::Answer;
  constexpr std::int64_t kNow_ns = 1'700'000'000'000'000'000, kLater_ns = kNow_ns + 5'000'000;
  constexpr sim::ActionKeys kKeys{7, 1, 2};
  const auto command = [](std::uint8_t device, std::uint8_t group, std::uint8_t mask, std::int64_t at_ns) {
    std::vector<std::uint8_t> data{0, 0, 0, device, 0, 0, 0, group, 0, 0, 0, mask};
    for (int shift = 56; shift >= 0; shift -= 8) data.push_back(static_cast<std::uint8_t>(at_ns >> shift));
    return data;
  };
  sim::CameraClock clock(5e6, 50e-6, kNow_ns);
  sim::GigeActions actions;
  const auto take = [&](std::uint8_t flags, const std::vector<std::uint8_t>& data) {
    return actions.take(flags, data, kKeys, clock, kNow_ns);
  };

  EXPECT_EQ(take(0x00, command(8, 1, 2, 0)), Answer::NotForUs);
  EXPECT_EQ(take(0x00, command(7, 2, 2, 0)), Answer::NotForUs);
  EXPECT_EQ(take(0x00, command(7, 1, 4, 0)), Answer::NotForUs);
  EXPECT_EQ(take(0x80, command(7, 1, 2, kLater_ns)), Answer::NoReferenceTime);
  EXPECT_FALSE(actions.next_utc_ns(Duration::zero()));

  clock.follow_utc(1000);
  EXPECT_EQ(take(0x80, command(7, 1, 2, kLater_ns)), Answer::Done);
  EXPECT_EQ(take(0x80, command(7, 1, 2, kNow_ns)), Answer::Late);
  EXPECT_EQ(take(0x00, command(7, 1, 3, 0)), Answer::Done);
  EXPECT_EQ(actions.next_utc_ns(Duration::zero()), kNow_ns);
  EXPECT_EQ(actions.next_utc_ns(Duration::zero()), kNow_ns);
  EXPECT_EQ(actions.next_utc_ns(Duration::zero()), kLater_ns - 1000) << "its clock is 1 us ahead";
  EXPECT_FALSE(actions.next_utc_ns(Duration::zero()));
}

/// The error with which a camera at 127.0.0.2 refuses this trigger.
Error refusal_of(const std::string& trigger) {
  AravisSettings settings = at_address("127.0.0.2");
  settings.trigger = trigger;
  const Status begun = started(*make_aravis_camera(CameraId{0}, "north", settings));
  return begun ? Error{} : begun.error();
}

TEST_F(GigeExposures, AnActionNeedsARate) {
  ServedGigE served("127.0.0.2", "C5");
  ASSERT_TRUE(served.running());

  const Error refused = refusal_of("action");

  EXPECT_EQ(refused.code, ErrorCode::InvalidArgument);
  EXPECT_THAT(refused.message, HasSubstr("needs rate_hz"));
}

TEST_F(GigeExposures, ALineOfTheCameraTriggersIt) {
  ServedGigE served("127.0.0.2", "C6");
  ASSERT_TRUE(served.running());
  AravisSettings settings = at_address("127.0.0.2");
  settings.trigger = "Line0";
  const auto camera = make_aravis_camera(CameraId{0}, "north", settings);
  ASSERT_TRUE(started(*camera));

  EXPECT_TRUE(whole_frame(*camera));
  EXPECT_EQ(served.device().trigger(), sim::GigeDevice::Trigger::Line);
}

TEST_F(GigeExposures, AnUnknownLineIsRefusedWithAListOfTheKnownOnes) {
  ServedGigE served("127.0.0.2", "C7");
  ASSERT_TRUE(served.running());

  const Error refused = refusal_of("Line7");

  EXPECT_THAT(refused.message, HasSubstr("trigger Line7 is refused"));
  EXPECT_THAT(refused.message, HasSubstr("Action1"));
}

}  // namespace gige_chunks_test
}  // namespace mocap::cameras
