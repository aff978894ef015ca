#include "cameras/node/node_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zmq.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "base/key_check.h"
#include "cameras/node/node_clock.h"
#include "wire/zmq_context.h"
#include "wire/zmq_node_server.h"
#include "wire/zmq_socket.h"

namespace mocap::cameras {
namespace node_camera_test {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

constexpr Duration kLong = seconds(30);  // time limit of a failing test

// The node's clock is 20 ms ahead of the host's and gains 50 ppm.
Timestamp ahead(Timestamp host) { return host + milliseconds(20) + from_s(50e-6 * to_s(host.time_since_epoch())); }

// A node with one camera "north" that exposes every millisecond.
class SimulatedNode {
 public:
  explicit SimulatedNode(std::string endpoint = "tcp://127.0.0.1:*", bool recorded = false,
                         std::uint64_t images = ~std::uint64_t{0}, const PtpClock* ptp = nullptr) {
    wire::NodeServerSettings settings;
    settings.node.endpoint = std::move(endpoint);
    settings.node.name = "left";
    settings.recorded = recorded;
    settings.clock = recorded ? nullptr : ahead;
    settings.ptp = ptp;
    auto opened = wire::ZmqNodeServer::open(settings);
    EXPECT_TRUE(opened) << opened.error().message;
    server_ = std::move(*opened);
    thread_ = std::jthread([this, recorded, images](const std::stop_token& stop) { run(stop, recorded, images); });
  }
  const std::string& endpoint() const { return server_->endpoints().front(); }
  bool acknowledged() const { return acknowledged_; }
  // The true exposure of an image, on the host's clock.
  Timestamp exposed_at(std::uint64_t number) {
    const std::lock_guard<std::mutex> lock(mutex_);
    return exposures_.at(number);
  }
  std::atomic<bool> answers{true};
  std::atomic<bool> in_the_future{false};  // images say that they are exposed in an hour
  std::atomic<bool> size_is_known{true};
  std::atomic<NodeCameraState> state{NodeCameraState::Delivering};

 private:
  void run(const std::stop_token& stop, bool recorded, std::uint64_t images) {
    std::uint64_t number = 0;
    while (!stop.stop_requested()) {
      const NodeCameraState now = number < images ? state.load() : NodeCameraState::Ended;
      const bool known = size_is_known;
      if (answers) server_->serve({{"north", known ? 64U : 0U, known ? 48U : 0U, now}}, milliseconds(1));
      acknowledged_ = server_->acknowledged(CameraId{0});
      if (number >= images) continue;
      BlobFrame frame;
      frame.camera = CameraId{0};
      frame.number = number;
      frame.exposed_at = recorded ? from_ns(static_cast<std::int64_t>(number) * 1'000'000) : host_now();
      if (in_the_future) frame.exposed_at += std::chrono::hours(1);
      frame.received_at = frame.detected_at = frame.exposed_at;
      {
        const std::lock_guard<std::mutex> lock(mutex_);
        exposures_[number] = frame.exposed_at;
      }
      Blob blob;
      blob.track = BlobTrackId{3};
      frame.blobs.push_back(blob);
      const bool sent = server_->send(frame) == NodeSend::Done;
      if (sent || !recorded) ++number;
    }
  }

  std::mutex mutex_;
  std::map<std::uint64_t, Timestamp> exposures_;
  std::unique_ptr<wire::ZmqNodeServer> server_;
  std::atomic<bool> acknowledged_{false};
  std::jthread thread_;
};

struct Host {
  StreamCounters counters;
  std::unique_ptr<BlobCamera> camera;

  explicit Host(const std::string& endpoint, bool recorded = false, Duration window = milliseconds(50),
                NodeClocks* clocks = nullptr, const PtpClock* ptp = nullptr) {
    NodeCameraSettings settings;
    settings.endpoint = endpoint;
    settings.recorded = recorded;
    auto made = make_node_camera(CameraId{4}, "north", settings,
                                 {.counters = &counters, .window = window, .node_clocks = clocks, .ptp = ptp});
    EXPECT_TRUE(made) << made.error().message;
    camera = std::move(*made);
  }

  // Starts the camera, in as many attempts as necessary.
  bool start() {
    const Timestamp until = host_now() + kLong;
    while (host_now() < until) {
      if (camera->start()) return true;
    }
    return false;
  }

  // The next image; fails at the time limit, and with other errors than Timeout.
  Result<Frame> image() {
    const Timestamp until = host_now() + kLong;
    for (;;) {
      Result<Frame> frame = camera->next(milliseconds(50));
      if (frame || frame.error().code != ErrorCode::Timeout || host_now() > until) return frame;
    }
  }
};

TEST(NodeCamera, DeliversBlobsWithTheirTracksOnTheHostsClock) {
  SimulatedNode node;
  Host host(node.endpoint());
  ASSERT_TRUE(host.start());

  const Timestamp begun = host_now();
  Timestamp last;
  for (int i = 0; i < 200; ++i) {
    const auto frame = host.image();
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_EQ(frame->camera, CameraId{4});
    EXPECT_EQ(frame->image.width_px, 64);
    EXPECT_EQ(frame->image.bytes.size(), 64U * 48U);
    EXPECT_GT(frame->exposed_at, last);
    EXPECT_LE(frame->received_at, host_now());
    last = frame->exposed_at;
    ASSERT_EQ(host.camera->blobs().size(), 1U);
    EXPECT_EQ(host.camera->blobs()[0].track, BlobTrackId{3});
  }
  // On the node's clock all exposures would be in the future by hours of drift and 20 ms.
  EXPECT_GT(last, begun - seconds(2));
  EXPECT_LE(last, host_now() + milliseconds(50));
  EXPECT_GT(host.counters.clock_uncertainty_us.load(), 0.0);
  EXPECT_EQ(host.counters.clock_source.load(), ClockSource::Receipts);
}

// One set with a time of the future would make the images of all other cameras late.
TEST(NodeCamera, RefusesAnImageThatIsExposedInTheFuture) {
  SimulatedNode node;
  Host host(node.endpoint());
  ASSERT_TRUE(host.start());
  ASSERT_TRUE(host.image());

  node.in_the_future = true;
  Result<Frame> refused = host.image();
  while (refused) {
    ASSERT_LE(refused->exposed_at, host_now() + milliseconds(50));
    refused = host.image();
  }
  EXPECT_EQ(refused.error().code, ErrorCode::Io) << refused.error().message;
  node.in_the_future = false;
  Result<Frame> accepted = host.image();
  while (!accepted && accepted.error().code == ErrorCode::Io) accepted = host.image();

  ASSERT_TRUE(accepted) << accepted.error().message;
  EXPECT_LE(accepted->exposed_at, host_now() + milliseconds(50));
}

// PTP's time is that of the host's clock, `wrong` apart from it; `gains` per second of the machine's clock.
struct KnownPtp : PtpClock {
  explicit KnownPtp(double gains, Duration wrong = {}) : rate(gains), error(wrong) {}
  Status measure() override { return {}; }
  std::optional<PtpLine> line(Timestamp at) const override {
    return PtpLine{7, at, at.time_since_epoch() + error, rate, std::chrono::nanoseconds(300)};
  }
  double rate;
  Duration error;
};

// A host of one node, each with its own PTP.
struct PtpPair {
  PtpPair(const PtpClock& of_node, const PtpClock& of_host)
      : node("tcp://127.0.0.1:*", false, ~std::uint64_t{0}, &of_node),
        host(node.endpoint(), false, milliseconds(50), nullptr, &of_host) {}

  // The largest error of an exposure among the next images.
  double worst_us(int images) {
    double worst = 0.0;
    for (int i = 0; i < images; ++i) {
      const auto frame = host.image();
      EXPECT_TRUE(frame) << frame.error().message;
      if (!frame) return std::numeric_limits<double>::infinity();
      worst = std::max(worst, std::abs(to_us(frame->exposed_at - node.exposed_at(frame->number))));
    }
    return worst;
  }

  SimulatedNode node;
  Host host;
};

TEST(NodeCamera, KnowsTheClockOfANodeByPtp) {
  const KnownPtp of_node(1.0 / (1.0 + 50e-6) - 1.0), of_host(0.0);
  PtpPair pair(of_node, of_host);
  ASSERT_TRUE(pair.host.start());

  EXPECT_LT(pair.worst_us(300), 1.0);

  EXPECT_EQ(pair.host.counters.clock_source.load(), ClockSource::Ptp);
  EXPECT_LT(pair.host.counters.clock_uncertainty_us.load(), 10.0);
}

TEST(NodeCamera, EstimatesTheClockOfANodeWhosePtpIsWrong) {
  const KnownPtp of_node(0.0, seconds(37)), of_host(0.0);
  PtpPair pair(of_node, of_host);
  ASSERT_TRUE(pair.host.start());

  EXPECT_LT(pair.worst_us(50), 100'000.0);

  EXPECT_EQ(pair.host.counters.clock_source.load(), ClockSource::Receipts);
}

// Two hosts of one camera have the same images: with a shared clock they agree to the nanosecond.
TEST(NodeCamera, AgreesWithTheOtherCamerasOfItsNodeOnEveryInstant) {
  SimulatedNode node;
  NodeClocks clocks;
  Host one(node.endpoint(), false, milliseconds(50), &clocks), other(node.endpoint(), false, milliseconds(50), &clocks);
  ASSERT_TRUE(one.start());
  ASSERT_TRUE(other.start());
  std::map<std::uint64_t, Timestamp> exposures;

  int common = 0;
  const Timestamp until = host_now() + kLong;
  while (common < 500 && host_now() < until) {
    for (Host* host : {&one, &other}) {
      const auto frame = host->image();
      ASSERT_TRUE(frame) << frame.error().message;
      const auto [entry, is_new] = exposures.emplace(frame->number, frame->exposed_at);
      EXPECT_EQ(entry->second, frame->exposed_at);
      common += is_new ? 0 : 1;
    }
  }

  EXPECT_GE(common, 500);
}

TEST(NodeCamera, NamesTheNodeAndTheCureIfNothingAnswers) {
  std::string endpoint;
  {
    SimulatedNode node;
    endpoint = node.endpoint();
  }
  Host host(endpoint);

  const Status started = host.camera->start();

  ASSERT_FALSE(started);
  EXPECT_EQ(started.error().code, ErrorCode::NotFound);
  EXPECT_THAT(started.error().message, HasSubstr("the node at " + endpoint + " does not answer"));
  EXPECT_THAT(started.error().message, HasSubstr("[node]"));
}

TEST(NodeCamera, IsLostWhenTheNodeFallsSilentAndGoesOnWithNewTracksAfterItsRestart) {
  auto node = std::make_unique<SimulatedNode>();
  const std::string endpoint = node->endpoint();
  Host host(endpoint);
  ASSERT_TRUE(host.start());
  ASSERT_TRUE(host.image());

  node.reset();
  Result<Frame> lost = host.image();
  while (lost) lost = host.image();
  EXPECT_EQ(lost.error().code, ErrorCode::DeviceLost);
  EXPECT_THAT(lost.error().message, HasSubstr("node 'left' at " + endpoint + " does not answer"));
  host.camera->stop();

  node = std::make_unique<SimulatedNode>(endpoint);
  ASSERT_TRUE(host.start());
  ASSERT_TRUE(host.image());
  // The node counts its tracks from the beginning; the id 3 of before is another marker.
  EXPECT_EQ(host.camera->blobs()[0].track, BlobTrackId{4 + 3});
}

// A peer that sends to everybody who connects, and nothing that a node sends.
class Babbler {
 public:
  explicit Babbler(const std::string& endpoint) {
    EXPECT_TRUE(socket_.open(context_, ZMQ_DEALER, "babbler"));
    EXPECT_TRUE(socket_.set(ZMQ_LINGER, 0));
    EXPECT_EQ(zmq_bind(socket_.get(), endpoint.c_str()), 0) << zmq_strerror(zmq_errno());
    thread_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        zmq_send(socket_.get(), "\xff\xff", 2, ZMQ_DONTWAIT);
        std::this_thread::sleep_for(milliseconds(1));  // the rate of the messages; the test does not wait here
      }
    });
  }

 private:
  wire::ZmqContext context_;
  wire::ZmqSocket socket_;
  std::jthread thread_;
};

TEST(NodeCamera, IsLostIfOnlyMalformedMessagesCome) {
  auto node = std::make_unique<SimulatedNode>();
  const std::string endpoint = node->endpoint();
  Host host(endpoint);
  ASSERT_TRUE(host.start());
  ASSERT_TRUE(host.image());

  node.reset();
  const Babbler babbler(endpoint);
  const Timestamp until = host_now() + kLong;
  Result<Frame> lost = host.image();
  while ((lost || lost.error().code == ErrorCode::Io) && host_now() < until) lost = host.image();

  ASSERT_FALSE(lost);
  EXPECT_EQ(lost.error().code, ErrorCode::DeviceLost);
  EXPECT_THAT(lost.error().message, HasSubstr("is this the [node] endpoint of a mocapd"));
}

TEST(NodeCamera, SaysThatTheCameraOfTheNodeHasNoImages) {
  SimulatedNode node;
  Host host(node.endpoint());
  ASSERT_TRUE(host.start());
  node.state = NodeCameraState::Ended;

  Result<Frame> lost = host.image();
  while (lost) lost = host.image();

  EXPECT_EQ(lost.error().code, ErrorCode::DeviceLost);
  EXPECT_THAT(lost.error().message,
              HasSubstr("node 'left' at " + node.endpoint() + " has no images of its camera 'north'"));
}

TEST(NodeCamera, RefusesImagesWhoseTimesAreLessCertainThanTheWindow) {
  SimulatedNode node;
  Host host(node.endpoint(), false, Duration{1});

  Status started = host.camera->start();
  const Timestamp until = host_now() + kLong;
  while (!started && started.error().message.find("clock") == std::string::npos && host_now() < until) {
    started = host.camera->start();
  }

  ASSERT_FALSE(started);
  EXPECT_THAT(started.error().message, HasSubstr("the clock of node 'left'"));
  EXPECT_THAT(started.error().message, HasSubstr("window_us"));
}

TEST(NodeCamera, DeliversEachImageOfARecordingWithItsTimeAndItsEnd) {
  constexpr std::uint64_t kImages = 500;
  SimulatedNode node("tcp://127.0.0.1:*", true, kImages);
  Host host(node.endpoint(), true);
  ASSERT_TRUE(host.start());

  for (std::uint64_t i = 0; i < kImages; ++i) {
    const auto frame = host.image();
    ASSERT_TRUE(frame) << frame.error().message;
    EXPECT_EQ(frame->number, i);
    EXPECT_EQ(frame->exposed_at, from_ns(static_cast<std::int64_t>(i) * 1'000'000));
    EXPECT_EQ(frame->received_at, frame->exposed_at);
  }
  const auto end = host.image();
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().code, ErrorCode::EndOfStream);
  const Timestamp until = host_now() + kLong;
  while (!node.acknowledged() && host_now() < until) std::this_thread::yield();
  EXPECT_TRUE(node.acknowledged());
}

TEST(NodeCamera, DeliversTheFirstImageOfARecordingWhoseSizeIsNotKnownAtFirst) {
  SimulatedNode node("tcp://127.0.0.1:*", true, 100);
  node.size_is_known = false;
  Host host(node.endpoint(), true);

  Status started = host.camera->start();
  const Timestamp until = host_now() + kLong;
  while (!started && started.error().message.find("has no images") == std::string::npos && host_now() < until) {
    started = host.camera->start();
  }
  ASSERT_FALSE(started);
  EXPECT_EQ(started.error().code, ErrorCode::NotFound);
  node.size_is_known = true;
  ASSERT_TRUE(host.start());
  const auto frame = host.image();

  ASSERT_TRUE(frame) << frame.error().message;
  EXPECT_EQ(frame->number, 0U);
  EXPECT_EQ(host.counters.missing_packets.load(), 0U);
}

TEST(NodeCamera, CountsTheImagesOfARecordingThatCameWhileItStartedAgain) {
  SimulatedNode node("tcp://127.0.0.1:*", true);
  Host host(node.endpoint(), true);
  ASSERT_TRUE(host.start());
  const auto before = host.image();
  ASSERT_TRUE(before) << before.error().message;
  const std::uint64_t last = before->number;

  host.camera->stop();
  ASSERT_TRUE(host.start());
  const auto after = host.image();

  ASSERT_TRUE(after) << after.error().message;
  EXPECT_EQ(host.counters.missing_packets.load(), after->number - last - 1);
}

TEST(NodeCamera, LogsOnceThatTheNodeOfARecordingDoesNotAnswerAndWaits) {
  auto node = std::make_unique<SimulatedNode>("tcp://127.0.0.1:*", true);
  Host host(node->endpoint(), true);
  ASSERT_TRUE(host.start());
  ASSERT_TRUE(host.image());

  node.reset();
  while (host.camera->next(milliseconds(50))) {
  }
  const auto log_of_next = [&host] {
    testing::internal::CaptureStderr();
    EXPECT_EQ(host.camera->next(milliseconds(50)).error().code, ErrorCode::Timeout);
    return testing::internal::GetCapturedStderr();
  };
  std::string log, later;
  const Timestamp until = host_now() + kLong;
  while (log.find("does not answer") == std::string::npos && host_now() < until) log += log_of_next();
  for (int i = 0; i < 5; ++i) later += log_of_next();

  EXPECT_THAT(log, HasSubstr("camera north: node 'left' at"));
  EXPECT_THAT(log, HasSubstr("does not answer for more than 2 s"));
  EXPECT_THAT(later, testing::Not(HasSubstr("does not answer")));
}

TEST(NodeCameraSettings, RefusesAnotherMachineWithoutKeys) {
  NodeCameraSettings settings;
  settings.endpoint = "tcp://10.0.0.7:5575";
  ASSERT_EQ(faults_of(settings).size(), 1U);
  EXPECT_THAT(faults_of(settings)[0].message, HasSubstr("no key proves which machine sends"));

  settings.server_key = "node.key";
  ASSERT_EQ(faults_of(settings).size(), 1U);
  EXPECT_THAT(faults_of(settings)[0].message, HasSubstr("go together"));

  settings.secret_key = "own.key";
  EXPECT_TRUE(faults_of(settings).empty());
}

TEST(NodeCameraSettings, RefusesAnEndpointWithoutAPortNumber) {
  for (const char* endpoint : {"", "tcp://127.0.0.1", "tcp://127.0.0.1:*", "udp://127.0.0.1:1"}) {
    NodeCameraSettings settings;
    settings.endpoint = endpoint;
    EXPECT_EQ(faults_of(settings).size(), 1U) << endpoint;
  }
}

}  // namespace node_camera_test
}  // namespace mocap::cameras
