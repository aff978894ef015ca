// Tests of the programs mocap-watch and subscribe.py with a feed of this process.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "support/places.h"
#include "support/shell.h"
#include "support/temporary_folder.h"
#include "wire/codec/json.h"
#include "wire/sample_description.h"
#include "wire/zmq_publisher.h"

namespace mocap::watch {
namespace mocap_watch_test {

using ::testing::HasSubstr;

struct Outcome {
  int exit_code;
  std::string out;
};

Outcome run(const std::string& command) {
  std::FILE* pipe = ::popen(command.c_str(), "r");
  EXPECT_NE(pipe, nullptr);
  std::string out;
  char piece[4096];
  for (std::size_t n = 0; (n = std::fread(piece, 1, sizeof(piece), pipe)) > 0;) out.append(piece, n);
  const int status = ::pclose(pipe);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, out};
}

Outcome watch(const std::string& arguments) {
  return run(support::quoted(support::program_folder() + "/mocap-watch") + " " + arguments);
}

// A feed of one subject with two markers, one of them lost, and of other points. The publisher skips every tenth
// snapshot.
class Feed {
 public:
  explicit Feed(std::size_t points = 0)
      : points_(points), publisher_(std::move(*wire::ZmqPublisher::open({.endpoint = "tcp://127.0.0.1:*"}))) {
    EXPECT_TRUE(publisher_->describe(wire::testing::sample_description()));
    thread_ = std::jthread([this](const std::stop_token& stop) { send(stop); });
  }
  const std::string& endpoint() const { return publisher_->endpoint(); }

 private:
  void send(const std::stop_token& stop) {
    Snapshot snapshot;
    snapshot.expected_views = 2;
    snapshot.views.push_back({CameraId{0}, 1, {}, 2});
    snapshot.views.push_back({CameraId{1}, 1, {}, 2});
    SubjectLabels& labels = snapshot.labels.push_back({});
    labels.subject = SubjectId{0};
    labels.phase = SubjectPhase::Tracking;
    labels.markers.resize(2);
    labels.markers[0].state = LabelState::Measured;
    for (std::size_t i = 0; i < points_; ++i) {
      snapshot.unlabelled.push_back({}).position = WorldPoint{{0.123456, 0.234567, 0.345678}};
    }
    Health health;
    health.latency[2] = {100, std::chrono::microseconds(400), std::chrono::microseconds(900),
                         std::chrono::microseconds(1500)};
    CameraHealth& north = health.cameras.emplace_back();
    north.name = "north";
    north.phase = CameraPhase::Streaming;
    north.rate_hz = 120.0;
    north.frames = 1000;
    north.missing_frames = 3;
    north.reopened = 1;
    while (!stop.stop_requested()) {
      ++snapshot.number;
      const Timestamp now = host_now();
      snapshot.instants = {now, now, now, now, std::nullopt};
      if (snapshot.number % 10 != 0) {
        EXPECT_TRUE(publisher_->publish(snapshot));
      } else {
        EXPECT_TRUE(publisher_->report(health));
      }
      std::this_thread::sleep_for(
          std::chrono::milliseconds(4));  // the period of the feed; the sleep waits for no event
    }
  }

  std::size_t points_;
  std::unique_ptr<wire::ZmqPublisher> publisher_;
  std::jthread thread_;
};

TEST(MocapWatch, PrintsEveryFrameAsALineOfJson) {
  Feed feed;

  const Outcome done = watch(feed.endpoint() + " --json --frames 50");

  EXPECT_EQ(done.exit_code, 0);
  std::istringstream lines(done.out);
  std::string line;
  std::uint64_t count = 0;
  std::uint64_t before = 0;
  while (std::getline(lines, line)) {
    const auto message = wire::message_from_json_line(line);
    ASSERT_TRUE(message) << message.error().message;
    if (count > 0) {
      EXPECT_EQ(message->sequence(), before + 1);
    }
    before = message->sequence();
    ++count;
  }
  EXPECT_EQ(count, 50U);
}

TEST(MocapWatch, PrintsTheStateOfTheFeedInOneLine) {
  Feed feed;

  const Outcome done = watch(feed.endpoint() + " --seconds 2.5");

  EXPECT_EQ(done.exit_code, 0);
  EXPECT_THAT(done.out, HasSubstr("cameras 2 of 2"));
  EXPECT_THAT(done.out, HasSubstr("markers 1 of 2"));
  EXPECT_THAT(done.out, HasSubstr("actor=tracking"));
  EXPECT_THAT(done.out, HasSubstr("fuse 0.4/0.9/1.5"));
  EXPECT_THAT(done.out, HasSubstr("lost 0 drops 3"));
}

TEST(MocapWatch, WritesASummaryAsOneJsonObject) {
  Feed feed;
  const support::TemporaryFolder folder;
  const std::string file = (folder.path() / "summary.json").string();

  const Outcome done = watch(feed.endpoint() + " --json --frames 60 --summary " + file + " >/dev/null");

  EXPECT_EQ(done.exit_code, 0);
  const auto summary = nlohmann::json::parse(run("cat " + file).out);
  EXPECT_EQ(summary.at("frames"), 60);
  EXPECT_EQ(summary.at("lost"), 0);
  EXPECT_GT(summary.at("passed_over"), 0);  // the daemon skipped sets
  EXPECT_EQ(summary.at("complete_share"), 1.0);
  EXPECT_EQ(summary.at("tracking_share"), 1.0);
  EXPECT_EQ(summary.at("labelled_share"), 0.5);
  EXPECT_EQ(summary.at("latency").at("fuse").at("p99_ms"), 0.9);
  EXPECT_EQ(summary.at("cameras").at("north").at("missing_frames"), 3);
  EXPECT_LT(summary.at("age_p50_ms"), 1000.0);
}

TEST(MocapWatch, ReportsThatNothingListensAndExitsWith69) {
  std::string endpoint;
  {
    const Feed feed;
    endpoint = feed.endpoint();
  }

  const Outcome done = watch(endpoint + " --seconds 0.3 2>&1");

  EXPECT_EQ(done.exit_code, 69);
  EXPECT_THAT(done.out, HasSubstr("no data from " + endpoint));
  EXPECT_THAT(done.out, HasSubstr("nothing listens at " + endpoint));
}

TEST(MocapWatch, ReportsThatTheDaemonIsSilent) {
  const auto publisher = wire::ZmqPublisher::open({.endpoint = "tcp://127.0.0.1:*"});
  ASSERT_TRUE(publisher);

  const Outcome done = watch((*publisher)->endpoint() + " --seconds 0.5 2>&1");

  EXPECT_EQ(done.exit_code, 69);
  EXPECT_THAT(done.out, HasSubstr("connected, but nothing was received yet"));
}

TEST(MocapWatch, EndsWhenItsOutputIsClosed) {
  Feed feed;

  const Outcome done = run("timeout 20 " + support::quoted(support::program_folder() + "/mocap-watch") + " " +
                           feed.endpoint() + " --json | head -n 3 | wc -l");

  EXPECT_EQ(done.out, "3\n");
}

// mocap-watch --json, whose output is a pipe that the test reads.
class PipedWatch {
 public:
  explicit PipedWatch(const std::string& endpoint) {
    const std::string program = support::program_folder() + "/mocap-watch";
    EXPECT_EQ(::pipe2(ends_, O_CLOEXEC), 0);
    process_ = ::fork();
    if (process_ != 0) return;
    ::dup2(ends_[1], STDOUT_FILENO);
    ::execl(program.c_str(), "mocap-watch", endpoint.c_str(), "--json", nullptr);
    ::_exit(127);
  }
  PipedWatch(const PipedWatch&) = delete;
  PipedWatch& operator=(const PipedWatch&) = delete;
  ~PipedWatch() {
    for (const int end : ends_) ::close(end);
  }

  // Whether the pipe becomes full, so that the program waits for the reader.
  bool fills_the_pipe() const {
    const Timestamp limit = host_now() + kLong;
    pollfd room{.fd = ends_[1], .events = POLLOUT, .revents = 0};
    while (::poll(&room, 1, 0) == 1 && host_now() < limit) std::this_thread::yield();
    return ::poll(&room, 1, 0) == 0;
  }
  void stop() const { ::kill(process_, SIGTERM); }
  // The exit code; -1: the program did not end.
  int wait() const {
    const Timestamp limit = host_now() + kLong;
    int status = 0;
    while (::waitpid(process_, &status, WNOHANG) == 0) {
      if (host_now() < limit) {
        std::this_thread::yield();
        continue;
      }
      ::kill(process_, SIGKILL);
      ::waitpid(process_, &status, 0);
    }
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  static constexpr Duration kLong = std::chrono::seconds(60);
  int ends_[2] = {-1, -1};
  pid_t process_ = -1;
};

TEST(MocapWatch, EndsAtASignalInTheMiddleOfALineThatNobodyReads) {
  Feed feed(800);  // a line has more than 20 kB: several pages of the pipe

  const PipedWatch program(feed.endpoint());
  ASSERT_TRUE(program.fills_the_pipe());
  program.stop();

  EXPECT_EQ(program.wait(), 0);
}

TEST(MocapWatch, ReportsInvalidArguments) {
  EXPECT_EQ(watch("nonsense 2>&1").exit_code, 64);
  EXPECT_EQ(watch("--frames 0 2>&1").exit_code, 64);
  EXPECT_EQ(watch("--json --summary - 2>&1").exit_code, 64);
  EXPECT_EQ(watch("--help").exit_code, 0);
}

}  // namespace mocap_watch_test
}  // namespace mocap::watch
