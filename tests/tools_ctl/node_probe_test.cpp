// Asking real nodes over real sockets.
#include "ctl/camera/node_probe.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "wire/zmq_node_server.h"

namespace mocap::ctl {
namespace node_probe_test {

using ::testing::HasSubstr;

constexpr Duration kAmple = std::chrono::seconds(60);

// A node with one camera; counts how often an image found a host.
class Node {
 public:
  explicit Node(bool recorded) {
    wire::NodeServerSettings settings;
    settings.node.endpoint = "tcp://127.0.0.1:*";
    settings.node.name = "left";
    settings.recorded = recorded;
    auto opened = wire::ZmqNodeServer::open(settings);
    EXPECT_TRUE(opened) << opened.error().message;
    server_ = std::move(*opened);
    thread_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        server_->serve({{"north", 640, 480, NodeCameraState::Delivering}}, std::chrono::milliseconds(1));
        BlobFrame image;
        image.camera = CameraId{0};
        if (server_->send(image) != NodeSend::NoHost) ++images_;
      }
    });
  }
  std::string endpoint() const { return server_->endpoints().front(); }
  int images() const { return images_; }

 private:
  std::unique_ptr<wire::ZmqNodeServer> server_;
  std::atomic<int> images_{0};
  std::jthread thread_;
};

TEST(ProbeNodes, TellsWhatEachNodeHasAndWhichDoesNotAnswer) {
  const Node node(false);
  // Port 1 of loopback has no program.
  const auto answers = probe_nodes({{node.endpoint()}, {"tcp://127.0.0.1:1"}, {"nonsense"}}, std::chrono::seconds(2));
  ASSERT_EQ(answers.size(), 3U);
  ASSERT_TRUE(answers[0].echo) << answers[0].fault;
  EXPECT_EQ(answers[0].echo->node, "left");
  ASSERT_EQ(answers[0].echo->cameras.size(), 1U);
  EXPECT_EQ(answers[0].echo->cameras[0].name, "north");
  EXPECT_GT(round_trip(*answers[0].echo), Duration::zero());
  EXPECT_FALSE(answers[1].echo);
  EXPECT_THAT(answers[1].fault, HasSubstr("nothing listens at tcp://127.0.0.1:1"));
  EXPECT_FALSE(answers[2].echo);
  EXPECT_THAT(answers[2].fault, HasSubstr("nonsense"));
}

TEST(ProbeNodes, LeavesTheImagesOfARecordingToItsHost) {
  const Node node(true);
  const auto answers = probe_nodes({{node.endpoint()}}, kAmple);
  ASSERT_TRUE(answers[0].echo) << answers[0].fault;
  EXPECT_TRUE(answers[0].echo->recorded);
  EXPECT_EQ(node.images(), 0);
}

}  // namespace node_probe_test
}  // namespace mocap::ctl
