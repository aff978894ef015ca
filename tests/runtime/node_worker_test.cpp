#include "runtime/node_worker.h"

#include <gtest/gtest.h>

#include <atomic>
#include <set>
#include <thread>
#include <utility>

namespace mocap::runtime {
namespace node_worker_test {

constexpr Duration kLong = std::chrono::seconds(20);  // time limit of a failing test

// What the worker asked of its server.
struct Seen {
  std::atomic<std::uint64_t> sent{0};
  std::atomic<std::uint32_t> last_camera{99};
  std::atomic<bool> ended{false};
  std::atomic<bool> has_room{true};
  std::atomic<bool> acknowledges{false};
  std::atomic<std::uint32_t> width_px{0};
  std::atomic<std::uint64_t> served{0};
};

class FakeServer : public NodeServer {
 public:
  explicit FakeServer(Seen& seen) : seen_(seen) {}
  void serve(const std::vector<NodeCamera>& cameras, Duration /*patience*/) override {
    seen_.width_px = cameras.at(1).width_px;
    seen_.ended = cameras.at(1).state == NodeCameraState::Ended;
    ++seen_.served;
    std::this_thread::yield();
  }
  NodeSend send(const BlobFrame& frame) override {
    if (!seen_.has_room) return NodeSend::NoRoom;
    seen_.last_camera = frame.camera.value;
    ++seen_.sent;
    return NodeSend::Done;
  }
  bool acknowledged(CameraId /*camera*/) const override { return seen_.acknowledges; }
  WakeDescriptor& wake() override { return wake_; }

 private:
  Seen& seen_;
  WakeDescriptor wake_;
};

class NodeThread : public ::testing::Test {
 protected:
  void start(bool lossless) {
    worker = std::make_unique<NodeWorker>(std::make_unique<FakeServer>(seen), lossless);
    Description description;
    for (CameraChannel* channel : {&first, &second}) {
      channel->to_node = std::make_unique<SpscQueue<BlobFrame>>(4);
      description.cameras.emplace_back().name = channel == &first ? "north" : "south";
    }
    worker->change({&first, &second}, description);
    thread = std::jthread([this](const std::stop_token& stop) { worker->run(stop); });
  }
  template <class Condition>
  bool until(Condition holds) const {
    const Timestamp limit = host_now() + kLong;
    while (!holds()) {
      if (host_now() > limit) return false;
      std::this_thread::yield();
    }
    return true;
  }

  WakeSignal fusion;
  CameraChannel first{4, fusion}, second{4, fusion};
  Seen seen;
  std::unique_ptr<NodeWorker> worker;
  std::jthread thread;
};

TEST_F(NodeThread, SendsTheImagesUnderTheIndexOfTheirCamera) {
  start(false);
  second.width_px = 640;

  ASSERT_TRUE(second.to_node->try_push(BlobFrame{}));
  worker->wake();

  EXPECT_TRUE(until([&] { return seen.sent == 1; }));
  EXPECT_EQ(seen.last_camera, 1U);
  EXPECT_TRUE(until([&] { return seen.width_px == 640U; }));
}

TEST_F(NodeThread, KeepsTheImagesOfARecordingUntilThereIsRoom) {
  seen.has_room = false;
  start(true);
  for (int i = 0; i < 3; ++i) ASSERT_TRUE(second.to_node->try_push(BlobFrame{}));
  second.delivery = Delivery::Ended;

  const std::uint64_t served = seen.served;
  ASSERT_TRUE(until([&] { return seen.served > served + 2; }));

  EXPECT_EQ(seen.sent, 0U);
  EXPECT_FALSE(seen.ended);
  seen.has_room = true;

  EXPECT_TRUE(until([&] { return seen.sent == 3 && seen.ended; }));
}

TEST_F(NodeThread, HasEndedWhenTheHostsAcknowledgedTheEndOfEachRecording) {
  start(true);
  first.delivery = Delivery::Ended;
  second.delivery = Delivery::Ended;
  ASSERT_TRUE(until([&] { return seen.ended.load(); }));
  EXPECT_FALSE(worker->ended());

  seen.acknowledges = true;

  EXPECT_TRUE(until([&] { return worker->ended(); }));
}

}  // namespace node_worker_test
}  // namespace mocap::runtime
