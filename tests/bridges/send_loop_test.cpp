#include "bridges/udp/send_loop.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <cstdint>
#include <string>
#include <vector>

#include "bench/bridges/frame_times.h"
#include "bench/bridges/people_feed.h"
#include "settings/subject/marker_set_file.h"
#include "support/places.h"
#include "support/temporary_folder.h"

namespace mocap::bridge {
namespace send_loop_test {

// Another test of this program may have blocked it.
void unblock_the_signal() {
  sigset_t ends;
  sigemptyset(&ends);
  sigaddset(&ends, SIGTERM);
  pthread_sigmask(SIG_UNBLOCK, &ends, nullptr);
}

// Asks the program to end when the feed is silent.
class Ending : public PacketWriter {
 public:
  const std::vector<std::string>& write(const ClientFrame* frame, double /*time_s*/) override {
    EXPECT_EQ(frame, nullptr);
    std::raise(SIGTERM);
    return none_;
  }

 private:
  std::vector<std::string> none_;
};

TEST(SendLoop, ASignalBeforeTheFirstFrameIsNoFailure) {
  const support::TemporaryFolder folder;
  unblock_the_signal();
  SendOptions options;
  options.feed.endpoint = "tcp://127.0.0.1:1";  // nothing listens there
  options.port = "9";
  options.status_file = folder.path() / "status.json";
  Ending writer;

  EXPECT_EQ(send_until_stopped("test", options, writer), 0);
}

// A receiver so slow that a burst of frames arrives while a frame is written. Asks the program to end when frames are
// missing.
class Slow : public PacketWriter {
 public:
  explicit Slow(bench::PeopleFeed& feed) : feed_(feed) {}

  const std::vector<std::string>& write(const ClientFrame* frame, double /*time_s*/) override {
    if (frame != nullptr) {
      const std::uint64_t number = frame->info().number;
      if (last_ != 0) missed_ += number - last_ - 1;
      last_ = number;
    }
    if (missed_ > 0) std::raise(SIGTERM);
    for (int i = 0; i < kBurst; ++i) EXPECT_TRUE(feed_.send(++sent_, kTimes));
    return none_;
  }

 private:
  static constexpr int kBurst = 200;  // more than the program keeps
  static constexpr bench::FrameTimes kTimes{.first_ns = 1'000'000'000, .period_ns = 20'000'000};

  bench::PeopleFeed& feed_;
  std::vector<std::string> none_;
  std::uint64_t sent_ = 0;
  std::uint64_t last_ = 0;
  std::uint64_t missed_ = 0;
};

TEST(SendLoop, CountsTheFramesThatItSkippedBecauseItWasLate) {
  const support::TemporaryFolder folder;
  const auto set = settings::load_marker_set(support::source_folder() + "/config/markersets/rigid4.toml");
  ASSERT_TRUE(set);
  auto feed = bench::PeopleFeed::open(*set, 1, 50.0);
  ASSERT_TRUE(feed) << feed.error().message;
  SendOptions options;
  options.feed.endpoint = feed->endpoint();
  options.port = "9";
  options.rate_hz = 1000.0;
  options.status_file = folder.path() / "status.json";
  Slow writer(*feed);
  unblock_the_signal();

  ::testing::internal::CaptureStderr();
  const int exit_code = send_until_stopped("test", options, writer);
  const std::string log = ::testing::internal::GetCapturedStderr();

  EXPECT_EQ(exit_code, 0);
  EXPECT_THAT(log, ::testing::ContainsRegex(" lost=[0-9]+ skipped=[1-9]"));
}

}  // namespace send_loop_test
}  // namespace mocap::bridge
