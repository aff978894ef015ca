// A camera node and its fusion hosts over real sockets.
#include "wire/node_link.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zmq.h>

#include <atomic>
#include <filesystem>
#include <iterator>
#include <limits>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "mocap/v1/node.pb.h"
#include "support/temporary_folder.h"
#include "wire/zmq_node_server.h"
#include "wire/zmq_socket.h"

namespace mocap::wire {
namespace node_link_test {

using std::chrono::milliseconds;
using std::chrono::seconds;
using ::testing::HasSubstr;

constexpr Duration kLong = seconds(60);  // time limit of a failing test

BlobFrame image_of(std::uint32_t camera, std::uint64_t number) {
  BlobFrame frame;
  frame.camera = CameraId{camera};
  frame.number = number;
  frame.exposed_at = from_ns(1'000 + static_cast<std::int64_t>(number));
  frame.received_at = frame.detected_at = frame.exposed_at;
  Blob blob;
  blob.centroid.v = {0.1 + static_cast<double>(number), 1.0 / 3.0};
  blob.track = BlobTrackId{7};
  frame.blobs.push_back(blob);
  return frame;
}

// A node with the cameras "north" and "south"; its thread sends an image of each whenever a host wants them.
class RunningNode {
 public:
  explicit RunningNode(NodeServerSettings settings = {}) {
    if (settings.node.endpoint.empty()) settings.node.endpoint = "tcp://127.0.0.1:*";
    settings.node.name = "left";
    auto opened = ZmqNodeServer::open(settings);
    EXPECT_TRUE(opened) << opened.error().message;
    server_ = std::move(*opened);
    thread_ = std::jthread([this](const std::stop_token& stop) {
      const std::vector<NodeCamera> cameras{{"north", 640, 480, NodeCameraState::Delivering},
                                            {"south", 320, 240, NodeCameraState::NotYet}};
      std::uint64_t number = 0;
      while (!stop.stop_requested()) {
        server_->serve(cameras, milliseconds(1));
        if (!sends) continue;
        for (std::uint32_t i = 0; i < 2; ++i) server_->send(image_of(i, number));
        ++number;
      }
    });
  }
  const std::string& endpoint() const { return server_->endpoints().front(); }
  std::atomic<bool> sends{true};

 private:
  std::unique_ptr<ZmqNodeServer> server_;
  std::jthread thread_;
};

std::unique_ptr<NodeLink> link_to(const std::string& endpoint, const std::string& camera = "north",
                                  const ClientKeys& keys = {}) {
  auto link = NodeLink::open({endpoint, camera, keys});
  EXPECT_TRUE(link) << link.error().message;
  return std::move(*link);
}

// Calls until `news` comes; returns false at the time limit.
bool wait_for(NodeLink& link, NodeNews news, Duration limit = kLong) {
  const Timestamp until = host_now() + limit;
  Timestamp called_at;
  while (host_now() < until) {
    if (host_now() - called_at > milliseconds(50)) {
      link.call();
      called_at = host_now();
    }
    const auto next = link.next(milliseconds(20));
    if (next && *next == news) return true;
  }
  return false;
}

TEST(NodeLink, ReceivesTheImagesOfItsCameraWithoutLossOfAnyBit) {
  RunningNode node;
  const auto link = link_to(node.endpoint(), "south");
  ASSERT_TRUE(wait_for(*link, NodeNews::Image));

  std::uint64_t sequence = link->image().sequence, number = link->image().blobs.number;
  for (int i = 0; i < 100; ++i) {
    ASSERT_TRUE(wait_for(*link, NodeNews::Image));
    const NodeImage& image = link->image();
    const BlobFrame sent = image_of(1, image.blobs.number);
    // Both counts have the same gaps: none, or images that the connection lost.
    EXPECT_EQ(image.sequence - sequence, image.blobs.number - number);
    sequence = image.sequence;
    number = image.blobs.number;
    ASSERT_EQ(image.blobs.blobs.size(), 1U);
    EXPECT_EQ(image.blobs.blobs[0].centroid.v, sent.blobs[0].centroid.v);
    EXPECT_EQ(image.blobs.blobs[0].track, sent.blobs[0].track);
    EXPECT_EQ(image.blobs.exposed_at, sent.exposed_at);
  }
}

TEST(NodeLink, LearnsTheCameraAndBothClocks) {
  NodeServerSettings settings;
  settings.clock = [](Timestamp host) { return host + seconds(5); };
  RunningNode node(settings);
  const auto link = link_to(node.endpoint());

  ASSERT_TRUE(wait_for(*link, NodeNews::Echo));

  const NodeEcho& echo = link->echo();
  EXPECT_EQ(echo.node, "left");
  EXPECT_EQ(echo.camera.width_px, 640U);
  EXPECT_EQ(echo.camera.height_px, 480U);
  EXPECT_EQ(echo.camera.state, NodeCameraState::Delivering);
  EXPECT_NE(echo.session, 0U);
  EXPECT_LE(echo.called_at, echo.received_at - seconds(5));
  EXPECT_LE(echo.received_at, echo.sent_at);
  EXPECT_LE(echo.sent_at - seconds(5), echo.arrived_at);
}

TEST(NodeLink, IsRefusedWithTheNamesOfTheCameras) {
  RunningNode node;
  const auto link = link_to(node.endpoint(), "nroth");

  ASSERT_TRUE(wait_for(*link, NodeNews::Refusal));

  EXPECT_THAT(link->refusal(), HasSubstr("node 'left' has no camera 'nroth', only north, south"));
}

TEST(NodeLink, SaysThatNothingListensAndConnectsToANodeThatStartsLater) {
  std::string endpoint;
  {
    RunningNode node;
    endpoint = node.endpoint();
  }
  const auto link = link_to(endpoint);
  const Timestamp until = host_now() + kLong;
  while (link->fault().empty() && host_now() < until) static_cast<void>(link->next(milliseconds(20)));
  EXPECT_THAT(link->fault(), HasSubstr(endpoint));

  NodeServerSettings settings;
  settings.node.endpoint = endpoint;
  RunningNode node(settings);

  EXPECT_TRUE(wait_for(*link, NodeNews::Image));
}

TEST(NodeLink, GetsNoImagesWithoutCalls) {
  RunningNode node;
  node.sends = false;
  const auto link = link_to(node.endpoint());
  ASSERT_TRUE(wait_for(*link, NodeNews::Echo));
  node.sends = true;

  // Until the node's time limit for hosts has passed, images come; then a whole second has none.
  const Timestamp until = host_now() + kLong;
  Timestamp heard_at = host_now();
  while (host_now() - heard_at < seconds(1) && host_now() < until) {
    if (link->next(milliseconds(20))) heard_at = host_now();
  }

  EXPECT_LT(host_now(), until);
}

class NodeWithKeys : public ::testing::Test {
 protected:
  void SetUp() override {
    server_ = *new_key_pair();
    host_ = *new_key_pair();
    ASSERT_TRUE(save_key_pair(folder_.path() / "server.key", server_));
    ASSERT_TRUE(save_allowed_keys(folder_.path() / "allowed", {{host_.public_key, Role::Viewer, "fusion"}}));
    NodeServerSettings settings;
    settings.node.curve = {folder_.path() / "server.key", folder_.path() / "allowed"};
    node_ = std::make_unique<RunningNode>(settings);
  }

  support::TemporaryFolder folder_;
  KeyPair server_, host_;
  std::unique_ptr<RunningNode> node_;
};

TEST_F(NodeWithKeys, ServesAHostWhoseKeyIsAllowed) {
  const auto link = link_to(node_->endpoint(), "north", {server_.public_key, host_});

  EXPECT_TRUE(wait_for(*link, NodeNews::Image));
}

TEST_F(NodeWithKeys, SendsNothingToAnUnknownKeyAndTheHostSaysWhy) {
  const auto link = link_to(node_->endpoint(), "north", {server_.public_key, *new_key_pair()});
  const Timestamp until = host_now() + kLong;
  while (link->fault().empty() && host_now() < until) {
    link->call();
    EXPECT_FALSE(link->next(milliseconds(20)));
  }

  EXPECT_FALSE(link->fault().empty());
}

TEST_F(NodeWithKeys, SendsNothingToAHostWithoutAKeyOrWithAnotherServerKey) {
  for (const ClientKeys& keys : {ClientKeys{}, ClientKeys{new_key_pair()->public_key, host_}}) {
    const auto link = link_to(node_->endpoint(), "north", keys);
    const Timestamp until = host_now() + kLong;
    while (link->fault().empty() && host_now() < until) {
      link->call();
      EXPECT_FALSE(link->next(milliseconds(20)));
    }
    EXPECT_FALSE(link->fault().empty());
  }
}

// A host that sends arbitrary bytes, and a node that does.
TEST(NodeLink, SurvivesMalformedMessagesOnBothSides) {
  RunningNode node;
  ZmqContext context;
  ZmqSocket host;
  ASSERT_TRUE(host.open(context, ZMQ_DEALER, "host"));
  ASSERT_TRUE(host.set(ZMQ_LINGER, 0));
  ASSERT_EQ(zmq_connect(host.get(), node.endpoint().c_str()), 0);
  for (const std::string& bytes : {std::string(), std::string("\xff\xff"), std::string(1000, 'x')}) {
    zmq_send(host.get(), bytes.data(), bytes.size(), ZMQ_SNDMORE);
    zmq_send(host.get(), bytes.data(), bytes.size(), 0);
    zmq_send(host.get(), bytes.data(), bytes.size(), 0);
  }
  const auto link = link_to(node.endpoint());
  EXPECT_TRUE(wait_for(*link, NodeNews::Image));

  ZmqSocket liar;
  ASSERT_TRUE(liar.open(context, ZMQ_DEALER, "liar"));
  ASSERT_TRUE(liar.set(ZMQ_LINGER, 0));
  ASSERT_EQ(zmq_bind(liar.get(), "tcp://127.0.0.1:*"), 0);
  const auto deceived = link_to(liar.last_endpoint());
  std::size_t refused = 0;
  const Timestamp until = host_now() + kLong;
  while (refused < 3 && host_now() < until) {
    zmq_send(liar.get(), "\xff\xff", 2, ZMQ_DONTWAIT);
    const auto next = deceived->next(milliseconds(20));
    ASSERT_FALSE(next);
    refused += next.error().code == ErrorCode::Io ? 1 : 0;
  }
  EXPECT_EQ(refused, 3U);
}

std::string echo_at(std::int64_t sent_at_ns) {
  v1::NodeMessage message;
  message.mutable_echo()->set_sent_at_ns(sent_at_ns);
  return message.SerializeAsString();
}

std::string echo_with_ptp(std::int64_t uncertainty_ns) {
  v1::NodeMessage message;
  message.mutable_echo()->mutable_ptp()->set_uncertainty_ns(uncertainty_ns);
  return message.SerializeAsString();
}

std::string image_exposed_at(std::int64_t exposed_at_ns) {
  v1::NodeMessage message;
  message.mutable_image()->mutable_blobs()->set_exposed_at_ns(exposed_at_ns);
  return message.SerializeAsString();
}

// The fault that a host finds in this message of a node.
std::string fault_in(const std::string& bytes) {
  ZmqContext context;
  ZmqSocket liar;
  EXPECT_TRUE(liar.open(context, ZMQ_DEALER, "liar"));
  EXPECT_TRUE(liar.set(ZMQ_LINGER, 0));
  EXPECT_EQ(zmq_bind(liar.get(), "tcp://127.0.0.1:*"), 0);
  const auto deceived = link_to(liar.last_endpoint());
  const Timestamp until = host_now() + kLong;
  while (host_now() < until) {
    zmq_send(liar.get(), bytes.data(), bytes.size(), ZMQ_DONTWAIT);
    const Result<NodeNews> next = deceived->next(milliseconds(20));
    if (next) return "accepted";
    if (next.error().code != ErrorCode::Timeout) return next.error().message;
  }
  return "nothing was received";
}

TEST(NodeLink, RefusesInstantsThatNoClockHas) {
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();

  for (const std::string& bytes : {echo_at(kMost), echo_at(-1), image_exposed_at(kMost), image_exposed_at(-kMost)}) {
    EXPECT_THAT(fault_in(bytes), HasSubstr("impossible instants"));
  }
  EXPECT_EQ(fault_in(echo_at(1)), "accepted");
}

TEST(NodeLink, RefusesAnUncertaintyOfPtpThatOverflows) {
  EXPECT_THAT(fault_in(echo_with_ptp(std::numeric_limits<std::int64_t>::max())), HasSubstr("impossible PTP time"));
  EXPECT_EQ(fault_in(echo_with_ptp(1000)), "accepted");
}

TEST(NodeServer, RefusesAnEndpointThatOtherMachinesReachWithoutKeys) {
  NodeServerSettings settings;
  settings.node.endpoint = "tcp://0.0.0.0:*";

  const auto opened = ZmqNodeServer::open(settings);

  ASSERT_FALSE(opened);
  EXPECT_THAT(opened.error().message, HasSubstr("allow_remote"));
}

TEST(NodeServer, SendsNoImageOfARecordingBeforeTheHostKnowsItsSize) {
  NodeServerSettings settings;
  settings.recorded = true;
  settings.node.endpoint = "tcp://127.0.0.1:*";
  auto server = std::move(*ZmqNodeServer::open(settings));
  const auto link = link_to(server->endpoints().front());
  const auto call_until_echo = [&](std::uint32_t width_px, std::uint32_t height_px) {
    const Timestamp until = host_now() + kLong;
    while (host_now() < until) {
      link->call();
      server->serve({{"north", width_px, height_px, NodeCameraState::Delivering}}, milliseconds(10));
      const auto next = link->next(milliseconds(10));
      if (next && *next == NodeNews::Echo && link->echo().camera.width_px == width_px) return true;
    }
    return false;
  };

  ASSERT_TRUE(call_until_echo(0, 0));
  EXPECT_EQ(server->send(image_of(0, 0)), NodeSend::NoHost);

  ASSERT_TRUE(call_until_echo(640, 480));
  EXPECT_EQ(server->send(image_of(0, 0)), NodeSend::Done);
}

// A recording waits for room instead of losing an image, and has one host for each camera.
TEST(NodeServer, LosesNoImageOfARecording) {
  NodeServerSettings settings;
  settings.recorded = true;
  settings.node.endpoint = "tcp://127.0.0.1:*";
  settings.node.send_queue = 2;
  auto server = std::move(*ZmqNodeServer::open(settings));
  const std::vector<NodeCamera> cameras{{"north", 640, 480, NodeCameraState::Delivering}};
  const auto link = link_to(server->endpoints().front());
  EXPECT_EQ(server->send(image_of(0, 0)), NodeSend::NoHost);

  // More than the kernel's buffers hold, with 512 blobs an image.
  constexpr std::uint64_t kImages = 600;
  BlobFrame image = image_of(0, 0);
  while (image.blobs.size() < kMaxBlobs) image.blobs.push_back(image.blobs[0]);
  std::uint64_t sent = 0, received = 0;
  Timestamp called_at;
  const Timestamp until = host_now() + kLong;
  bool full = false;
  while (received < kImages && host_now() < until) {
    if (host_now() - called_at > milliseconds(50)) {
      link->call();
      called_at = host_now();
    }
    server->serve(cameras, Duration::zero());
    while (sent < kImages) {
      image.number = sent;
      const NodeSend result = server->send(image);
      full = full || result == NodeSend::NoRoom;
      if (result != NodeSend::Done) break;
      ++sent;
    }
    for (int i = 0; i < (full ? 100 : 1); ++i) {
      const auto next = link->next(Duration::zero());
      if (!next || *next != NodeNews::Image) continue;
      ASSERT_EQ(link->image().blobs.number, received);
      ++received;
    }
  }

  EXPECT_TRUE(full);
  EXPECT_EQ(received, kImages);
  const auto second = link_to(server->endpoints().front());
  bool refused = false;
  while (!refused && host_now() < until) {
    second->call();
    server->serve(cameras, milliseconds(5));
    const auto next = second->next(milliseconds(5));
    refused = next && *next == NodeNews::Refusal;
  }
  EXPECT_TRUE(refused);
}

TEST(NodeLink, ListsTheCamerasWithoutTheirImages) {
  const RunningNode node;
  const auto link = link_to(node.endpoint(), "");
  ASSERT_TRUE(wait_for(*link, NodeNews::Echo));
  const NodeEcho& echo = link->echo();
  EXPECT_EQ(echo.node, "left");
  ASSERT_EQ(echo.cameras.size(), 2U);
  EXPECT_EQ(echo.cameras[0].name, "north");
  EXPECT_EQ(echo.cameras[0].width_px, 640U);
  EXPECT_EQ(echo.cameras[0].state, NodeCameraState::Delivering);
  EXPECT_EQ(echo.cameras[1].name, "south");
  EXPECT_EQ(echo.cameras[1].state, NodeCameraState::NotYet);
  // All news after further calls are echoes.
  for (int i = 0; i < 20; ++i) {
    link->call();
    const auto news = link->next(kLong);
    ASSERT_TRUE(news);
    EXPECT_EQ(*news, NodeNews::Echo);
  }
}

TEST(NodeLink, SharesItsThreadsWithTheOtherLinks) {
  const RunningNode node;
  const auto first = link_to(node.endpoint());
  ASSERT_TRUE(wait_for(*first, NodeNews::Echo));
  const auto threads = [] {
    const std::filesystem::directory_iterator tasks("/proc/self/task");
    return std::distance(begin(tasks), end(tasks));
  };
  const auto before = threads();
  const auto second = link_to(node.endpoint(), "south");
  const auto third = link_to(node.endpoint(), "");
  ASSERT_TRUE(wait_for(*second, NodeNews::Echo));
  ASSERT_TRUE(wait_for(*third, NodeNews::Echo));
  EXPECT_EQ(threads(), before);
}

}  // namespace node_link_test
}  // namespace mocap::wire
