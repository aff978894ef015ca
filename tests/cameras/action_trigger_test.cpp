// ActionTrigger against a UDP socket of the test that answers as a camera does. Time is an argument.
#include "cameras/aravis/action_trigger.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "cameras/clock/exposure_clock.h"
#include "cameras/own_network.h"

namespace mocap::cameras {
namespace action_trigger_test {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr Duration kPeriod = milliseconds(20);
constexpr Timestamp kBegin{seconds(1000)};  // on the host's clock

in_addr address_of(const char* text) {
  in_addr address{};
  inet_pton(AF_INET, text, &address);
  return address;
}

/// A camera that accepts scheduled commands only while it has a PTP master.
class CommandedCamera {
 public:
  CommandedCamera() : socket_(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
    sockaddr_in name{};
    name.sin_family = AF_INET;
    name.sin_addr = address_of("127.0.0.2");
    name.sin_port = htons(3956);
    bound_ = bind(socket_, reinterpret_cast<const sockaddr*>(&name), sizeof name) == 0;
  }
  ~CommandedCamera() { close(socket_); }
  CommandedCamera(const CommandedCamera&) = delete;
  CommandedCamera& operator=(const CommandedCamera&) = delete;

  bool bound() const { return bound_; }
  bool has_master = true;

  /// Exposures that the commands since the last call cause: scheduled ones on the camera's clock, immediate ones at
  /// `at_once`.
  std::vector<Duration> exposures_by(Duration at_once) {
    std::vector<Duration> exposures;
    std::array<std::uint8_t, 64> packet{};
    sockaddr_in from{};
    socklen_t length = sizeof from;
    while (recvfrom(socket_, packet.data(), packet.size(), 0, reinterpret_cast<sockaddr*>(&from), &length) >= 20) {
      const bool scheduled = (packet[1] & 0x80) != 0;
      if (!scheduled || has_master) exposures.push_back(scheduled ? time_in(packet) : at_once);
      const std::array<std::uint8_t, 8> answer{static_cast<std::uint8_t>(scheduled && !has_master ? 0x80 : 0),
                                               static_cast<std::uint8_t>(scheduled && !has_master ? 0x13 : 0),
                                               0x01,
                                               0x01,
                                               0,
                                               0,
                                               packet[6],
                                               packet[7]};
      if ((packet[1] & 0x01) == 0) continue;
      sendto(socket_, answer.data(), answer.size(), 0, reinterpret_cast<const sockaddr*>(&from), length);
    }
    return exposures;
  }

 private:
  static Duration time_in(const std::array<std::uint8_t, 64>& packet) {
    std::uint64_t ns = 0;
    for (std::size_t i = 20; i < 28; ++i) ns = ns << 8 | packet[i];
    return Duration{static_cast<Duration::rep>(ns)};
  }

  int socket_;
  bool bound_ = false;
};

class ActionTriggerTest : public testing::Test {
 protected:
  void SetUp() override {
    static const std::string refusal = enter_own_network(3);
    if (!refusal.empty()) GTEST_SKIP() << refusal;
    camera_.emplace();
    ASSERT_TRUE(camera_->bound());
    auto opened = ActionTrigger::open(address_of("127.0.0.1"), address_of("127.0.0.2"), kPeriod);
    ASSERT_TRUE(opened);
    trigger_ = std::move(*opened);
  }

  /// Runs the trigger for `span`. Returns the exposures of the camera, whose clock is `clock_minus_host` ahead, in
  /// their order.
  std::vector<Duration> follow(Duration span, Duration clock_minus_host, bool ahead) {
    std::vector<Duration> exposures;
    Timestamp last = now_;
    for (const Timestamp end = now_ + span; now_ < end; now_ = std::max(now_, trigger_->next_due())) {
      trigger_->send_due(now_, utc_minus_host_, ahead);
      const auto more = camera_->exposures_by(now_.time_since_epoch() + clock_minus_host);
      exposures.insert(exposures.end(), more.begin(), more.end());
      last = now_;
    }
    now_ = last + milliseconds(1);
    return exposures;
  }

  static void expect_each_once(const std::vector<Duration>& exposures) {
    for (std::size_t i = 0; i < exposures.size(); ++i) {
      EXPECT_EQ(exposures[i] % kPeriod, Duration::zero()) << i;
      EXPECT_EQ(exposures[i] - exposures[0], static_cast<Duration::rep>(i) * kPeriod) << i;
    }
  }

  const Duration utc_minus_host_ = seconds(500) + milliseconds(7);
  std::optional<CommandedCamera> camera_;
  std::unique_ptr<ActionTrigger> trigger_;
  Timestamp now_ = kBegin;
};

TEST_F(ActionTriggerTest, CommandsEachMultipleOnceIfTheCameraLosesAndRegainsItsMaster) {
  // The master distributes TAI; the clock was read 4 ms late.
  const Duration tai_minus_host = utc_minus_host_ + seconds(37);
  trigger_->set_clock(tai_minus_host - milliseconds(4));
  std::vector<Duration> all = follow(seconds(1), tai_minus_host, true);
  EXPECT_FALSE(trigger_->refused());

  camera_->has_master = false;
  for (const Duration each : follow(seconds(1), tai_minus_host, true)) all.push_back(each);
  EXPECT_TRUE(trigger_->refused());
  for (const Duration each : follow(seconds(1), tai_minus_host, false))
    all.push_back(each);  // the camera reports the loss itself
  EXPECT_FALSE(trigger_->refused());
  camera_->has_master = true;
  for (const Duration each : follow(seconds(1), tai_minus_host, true)) all.push_back(each);

  expect_each_once(all);
  EXPECT_GE(all.size(), 200U);  // 4 s, and the scheduled exposures
}

TEST_F(ActionTriggerTest, CommandsEachMultipleOnceIfTheCameraReportsTheLossAndStillAcceptsCommands) {
  trigger_->set_clock(utc_minus_host_);
  std::vector<Duration> all = follow(seconds(1), utc_minus_host_, true);
  for (const Duration each : follow(seconds(1), utc_minus_host_, false)) all.push_back(each);

  expect_each_once(all);
  EXPECT_GE(all.size(), 100U);
}

TEST_F(ActionTriggerTest, CommandsEachMultipleOnceAlthoughTheClockIsReadLate) {
  std::vector<Duration> all;
  for (int late_ms = 0; late_ms < 100; ++late_ms) {
    trigger_->set_clock(utc_minus_host_ - milliseconds(7 * late_ms % 40));
    for (const Duration each : follow(milliseconds(30), utc_minus_host_, true)) all.push_back(each);
  }

  expect_each_once(all);
  EXPECT_GE(all.size(), 100U);
}

TEST_F(ActionTriggerTest, CommandsEachMultipleOnceIfAnImageWaitsForItsThread) {
  const auto read_image = [this](Timestamp first_byte) {  // exposed in the last 5 ms, taken from the queue now
    trigger_->read_clock({.stamp = first_byte.time_since_epoch() + utc_minus_host_ - milliseconds(5),
                          .exposure = milliseconds(5),
                          .stamp_tells_begin = true,
                          .first_byte = first_byte,
                          .received = now_,
                          .utc_minus_host = utc_minus_host_});
  };
  read_image(now_ - milliseconds(1));
  std::vector<Duration> all = follow(seconds(1), utc_minus_host_, true);
  const Timestamp arrived = now_;
  now_ += milliseconds(400);  // a busy host delays the thread
  for (const Duration each : follow(kPeriod, utc_minus_host_, true)) all.push_back(each);

  read_image(arrived);
  for (const Duration each : follow(seconds(1), utc_minus_host_, true)) all.push_back(each);

  for (std::size_t i = 1; i < all.size(); ++i) EXPECT_GE(all[i] - all[i - 1], kPeriod) << i;
  EXPECT_GE(all.size(), 100U);
}

TEST_F(ActionTriggerTest, BeginsAnewIfTheClockJumpsBack) {
  trigger_->set_clock(utc_minus_host_);
  static_cast<void>(follow(seconds(1), utc_minus_host_, true));
  const Duration back = utc_minus_host_ - seconds(5);

  trigger_->set_clock(back);
  const std::vector<Duration> after = follow(seconds(1), back, true);

  expect_each_once(after);
  ASSERT_GE(after.size(), 50U);
  EXPECT_LT(after[0] - back - now_.time_since_epoch(), Duration::zero());
}

TEST_F(ActionTriggerTest, SkipsPastExposuresAfterADelay) {
  static_cast<void>(follow(milliseconds(100), utc_minus_host_, false));
  now_ += seconds(3);

  const std::vector<Duration> after = follow(milliseconds(100), utc_minus_host_, false);

  EXPECT_LE(after.size(), 6U);
}

}  // namespace action_trigger_test
}  // namespace mocap::cameras
