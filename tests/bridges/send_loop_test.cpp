#include "bridges/udp/send_loop.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
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

// A receiver so slow that many frames arrive while a frame is written. Asks the program to end as soon as the status
// file reports skipped frames.
class Slow : public PacketWriter {
 public:
  Slow(bench::PeopleFeed& feed, std::filesystem::path status_file)
      : feed_(feed), status_file_(std::move(status_file)) {}

  const std::vector<std::string>& write(const ClientFrame* /*frame*/, double /*time_s*/) override {
    if (skipped() > 0) std::raise(SIGTERM);
    for (int i = 0; i < kFrames; ++i) EXPECT_TRUE(feed_.send(++sent_, kTimes));
    return none_;
  }

 private:
  static constexpr int kFrames =
      100;  // some are lost at the queue of the feed; the others are more than the program writes
  static constexpr bench::FrameTimes kTimes{.first_ns = 1'000'000'000, .period_ns = 20'000'000};

  std::uint64_t skipped() const {
    std::ifstream file(status_file_);
    const auto status = nlohmann::json::parse(file, nullptr, false);
    return status.is_discarded() ? 0 : status.value("feed_skipped", std::uint64_t{0});
  }

  bench::PeopleFeed& feed_;
  std::filesystem::path status_file_;
  std::vector<std::string> none_;
  std::uint64_t sent_ = 0;
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
  options.seconds = 60.0;  // a limit; the writer ends the program
  Slow writer(*feed, options.status_file);
  unblock_the_signal();

  ::testing::internal::CaptureStderr();
  const int exit_code = send_until_stopped("test", options, writer);
  const std::string log = ::testing::internal::GetCapturedStderr();

  EXPECT_EQ(exit_code, 0);
  EXPECT_THAT(log, ::testing::ContainsRegex(" lost=[0-9]+ skipped=[1-9]"));
}

}  // namespace send_loop_test
}  // namespace mocap::bridge
