#include <google/protobuf/stubs/logging.h>
#include <zmq.h>

#include <atomic>
#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "base/expects.h"
#include "base/log.h"
#include "cameras/node/node_camera.h"
#include "fuzz/damage.h"
#include "fuzz/fuzz_arguments.h"
#include "mocap/v1/node.pb.h"
#include "wire/codec/camera_blobs.h"
#include "wire/node_link.h"
#include "wire/node_protocol.h"
#include "wire/zmq_node_server.h"
#include "wire/zmq_socket.h"

// Fuzzes both sides of the connection between a camera node and a fusion host over real sockets: a node with hosts that
// send damaged calls and disconnect at any time, and a camera of a host whose node sends damaged echoes, images and
// refusals. An image that the camera delivers must keep its bounds. Afterwards both sides must work as before.
//
// usage: node_fuzz [COUNT [SEED]]

namespace mocap::wire {
namespace {

constexpr Duration kGiveUp = std::chrono::minutes(4);
// Messages of a node between two calls: an echo that waits behind many more would be too late for start().
constexpr int kMostSinceCall = 200;
constexpr int kTrueImages = 200;  // more than wait in the queue of the camera

constexpr std::uint64_t kSession = 7;

// Makes random messages, most of them valid except for a few damaged bytes.
class Messages {
 public:
  explicit Messages(std::uint64_t seed) : random_(seed) {}

  int below(int end) { return static_cast<int>(random_() % static_cast<unsigned>(end)); }

  std::string call() {
    v1::NodeCall call;
    call.set_protocol(below(20) == 0 ? static_cast<std::uint32_t>(random_()) : kNodeProtocol);
    call.set_camera(below(10) == 0 ? fuzz::random_bytes(random_) : below(2) == 0 ? "north" : "south");
    call.set_called_at_ns(instant_ns());
    call.set_ended(below(50) == 0);
    return perhaps_damaged(call.SerializeAsString());
  }

  static v1::NodeMessage valid_echo(const v1::NodeCall& call, std::uint64_t session) {
    v1::NodeMessage message;
    v1::NodeEcho& echo = *message.mutable_echo();
    echo.set_called_at_ns(call.called_at_ns());
    echo.set_received_at_ns(to_ns(host_now()));
    echo.set_sent_at_ns(to_ns(host_now()));
    echo.set_node("liar");
    echo.set_session(session);
    echo.set_width_px(64);
    echo.set_height_px(48);
    echo.set_state(v1::NodeEcho::CAMERA_STATE_DELIVERING);
    return message;
  }

  static v1::NodeMessage valid_image(std::uint64_t number) {
    BlobFrame frame;
    frame.camera = CameraId{0};
    frame.number = number;
    frame.exposed_at = frame.received_at = frame.detected_at = host_now();
    frame.blobs.push_back({.centroid = PixelPoint{{3.0, 4.0}}, .track = BlobTrackId{3}});
    v1::NodeMessage message;
    encode(frame, *message.mutable_image()->mutable_blobs());
    message.mutable_image()->set_sequence(number);
    return message;
  }

  std::string echo(const v1::NodeCall& call) {
    v1::NodeMessage message = valid_echo(call, kSession);
    v1::NodeEcho& echo = *message.mutable_echo();
    switch (below(16)) {
      case 0: echo.set_called_at_ns(instant_ns()); break;
      case 1: echo.set_received_at_ns(instant_ns()); break;
      case 2: echo.set_sent_at_ns(instant_ns()); break;
      case 3: echo.set_node(fuzz::random_bytes(random_)); break;
      case 4: echo.set_session(random_()); break;
      case 5: echo.set_width_px(static_cast<std::uint32_t>(below(300))); break;
      case 6: echo.set_state(static_cast<v1::NodeEcho::CameraState>(below(4))); break;
      case 7: echo.set_recorded(below(4) == 0); break;
      default: break;
    }
    return perhaps_damaged(message.SerializeAsString());
  }

  std::string image(std::uint64_t number) {
    v1::NodeMessage message = valid_image(number);
    v1::NodeImage& image = *message.mutable_image();
    v1::CameraBlobs& blobs = *image.mutable_blobs();
    switch (below(12)) {
      case 0: image.set_sequence(random_()); break;
      case 1: blobs.set_exposed_at_ns(instant_ns()); break;
      case 2: blobs.set_received_at_ns(instant_ns()); break;
      case 3: blobs.set_x_px(0, below(2) == 0 ? std::nan("") : HUGE_VAL); break;
      case 4: blobs.set_track_ids_plus_one(0, static_cast<std::uint32_t>(random_())); break;
      case 5: blobs.add_x_px(1.0); break;
      case 6: blobs.set_number(random_()); break;
      default: break;
    }
    return perhaps_damaged(message.SerializeAsString());
  }

  std::string refusal() {
    v1::NodeMessage message;
    message.set_refusal(fuzz::random_bytes(random_));
    return message.SerializeAsString();
  }

 private:
  std::int64_t instant_ns() {
    switch (below(4)) {
      case 0: return static_cast<std::int64_t>(random_());
      case 1: return 0;
      default: return to_ns(host_now()) + (below(2000) - 1000) * 1'000'000LL;
    }
  }

  std::string perhaps_damaged(std::string bytes) {
    return below(3) != 0 ? bytes : fuzz::damaged(std::move(bytes), random_);
  }

  std::mt19937_64 random_;
};

std::unique_ptr<ZmqSocket> open_socket(const ZmqContext& context, int kind) {
  auto socket = std::make_unique<ZmqSocket>();
  MOCAP_EXPECTS(socket->open(context, kind, "fuzz").has_value() && socket->set(ZMQ_LINGER, 0).has_value());
  return socket;
}

// Returns whether all was sent.
bool send(const ZmqSocket& to, const std::string& bytes, int flags = 0) {
  return zmq_send(to.get(), bytes.data(), bytes.size(), ZMQ_DONTWAIT | flags) >= 0;
}

// A real node whose hosts are hostile.
class NodeFuzz {
 public:
  explicit NodeFuzz(std::uint64_t seed) : messages_(seed) {
    NodeServerSettings settings;
    settings.node.endpoint = "tcp://127.0.0.1:*";
    settings.node.name = "left";
    auto opened = ZmqNodeServer::open(settings);
    MOCAP_EXPECTS(opened.has_value());
    server_ = std::move(*opened);
  }

  void try_once() {
    if (hosts_.size() < 20 && messages_.below(10) == 0) connect();
    if (!hosts_.empty() && messages_.below(30) == 0) hosts_.pop_back();
    for (const auto& host : hosts_) {
      if (messages_.below(20) == 0) send(*host, messages_.call(), ZMQ_SNDMORE);
      send(*host, messages_.call());
    }
    server_->serve(cameras_, Duration::zero());
    BlobFrame frame;
    frame.camera = CameraId{static_cast<std::uint32_t>(messages_.below(2))};
    frame.exposed_at = frame.received_at = frame.detected_at = host_now();
    server_->send(frame);
  }

  // After the hostile hosts have gone, a normal one must be served.
  void check_still_well() {
    hosts_.clear();
    const auto link = std::move(*NodeLink::open({server_->endpoints().front(), "north"}));
    const Timestamp until = host_now() + kGiveUp;
    bool echoed = false;
    while (!echoed && host_now() < until) {
      link->call();
      server_->serve(cameras_, std::chrono::milliseconds(5));
      const Result<NodeNews> news = link->next(std::chrono::milliseconds(5));
      echoed = news && *news == NodeNews::Echo;
    }
    MOCAP_EXPECTS(echoed);
  }

 private:
  void connect() {
    auto host = open_socket(context_, ZMQ_DEALER);
    MOCAP_EXPECTS(zmq_connect(host->get(), server_->endpoints().front().c_str()) == 0);
    hosts_.push_back(std::move(host));
  }

  Messages messages_;
  const std::vector<NodeCamera> cameras_{{"north", 64, 48, NodeCameraState::Delivering},
                                         {"south", 64, 48, NodeCameraState::Delivering}};
  std::unique_ptr<ZmqNodeServer> server_;
  ZmqContext context_;
  std::vector<std::unique_ptr<ZmqSocket>> hosts_;
};

// A node that sends `count` messages, most of them wrong, and tells the truth afterwards, as a node that was started
// anew.
class Liar {
 public:
  Liar(std::uint64_t seed, std::uint64_t count)
      : messages_(seed), count_(count), socket_(open_socket(context_, ZMQ_ROUTER)) {
    MOCAP_EXPECTS(zmq_bind(socket_->get(), "tcp://127.0.0.1:*") == 0);
    endpoint_ = socket_->last_endpoint();
    thread_ = std::jthread([this](const std::stop_token& stop) {
      while (!stop.stop_requested()) run_once();
    });
  }
  const std::string& endpoint() const { return endpoint_; }
  bool tells_truth() const { return tells_truth_; }

 private:
  void run_once() {
    zmq_pollitem_t item{socket_->get(), 0, ZMQ_POLLIN, 0};
    zmq_poll(&item, 1, 1);
    v1::NodeCall call;
    while (receive(call)) answer(call);
    if (since_call_ > kMostSinceCall) return;
    tells_truth_ = sent_ >= count_;
    if (route_.empty()) return;
    for (int i = messages_.below(30); i > 0; --i) {
      const bool refuses = !tells_truth_ && messages_.below(200) == 0;
      send_to_host(refuses        ? messages_.refusal()
                   : tells_truth_ ? Messages::valid_image(sent_).SerializeAsString()
                                  : messages_.image(sent_));
    }
  }

  bool receive(v1::NodeCall& call) {
    ZmqMessage part;
    if (!part.receive(*socket_)) return false;
    route_ = part.bytes();
    since_call_ = 0;
    while (part.has_more() && part.receive(*socket_)) MOCAP_EXPECTS(call.ParseFromString(std::string(part.bytes())));
    return true;
  }

  void answer(const v1::NodeCall& call) {
    send_to_host(tells_truth_ ? Messages::valid_echo(call, kSession + 1).SerializeAsString() : messages_.echo(call));
  }

  void send_to_host(const std::string& bytes) {
    if (send(*socket_, route_, ZMQ_SNDMORE) && send(*socket_, bytes)) ++sent_, ++since_call_;
  }

  Messages messages_;
  std::uint64_t count_;
  std::uint64_t sent_ = 0;
  int since_call_ = 0;
  ZmqContext context_;
  std::unique_ptr<ZmqSocket> socket_;
  std::string endpoint_;
  std::string route_;
  std::atomic<bool> tells_truth_{false};
  std::jthread thread_;  // the last member, ends first
};

void check(const Frame& frame, const Blobs& blobs) {
  MOCAP_EXPECTS(frame.image.bytes.size() ==
                static_cast<std::size_t>(frame.image.width_px) * static_cast<std::size_t>(frame.image.height_px));
  for (const Blob& blob : blobs) MOCAP_EXPECTS(blob.centroid.v.allFinite() && blob.sigma_px > 0.0);
}

// A real camera of a node that lies, until the node tells the truth again and images come. The window is so long that
// late echoes do not matter.
void fuzz_camera(std::uint64_t count, std::uint64_t seed) {
  const Liar liar(seed, count);
  cameras::NodeCameraSettings settings;
  settings.endpoint = liar.endpoint();
  const auto camera = std::move(*cameras::make_node_camera(CameraId{4}, "north", settings, {.window = kGiveUp}));
  const Timestamp until = host_now() + kGiveUp;
  bool running = false;
  for (int true_images = 0; true_images < kTrueImages;) {
    MOCAP_EXPECTS(host_now() < until);
    if (!running) {
      running = camera->start().has_value();
      continue;
    }
    const Result<Frame> frame = camera->next(std::chrono::milliseconds(20));
    if (frame) {
      check(*frame, camera->blobs());
      true_images += liar.tells_truth() ? 1 : 0;
    } else if (frame.error().code != ErrorCode::Timeout && frame.error().code != ErrorCode::Io) {
      camera->stop();
      running = false;
    }
  }
}

}  // namespace
}  // namespace mocap::wire

int main(int argc, char** argv) {
  google::protobuf::SetLogHandler(nullptr);
  const mocap::fuzz::Arguments arguments(argc, argv);
  mocap::set_log_level(mocap::LogLevel::Error);
  {
    mocap::wire::NodeFuzz fuzz(arguments.seed);
    for (std::uint64_t i = 0; i < arguments.count; ++i) fuzz.try_once();
    fuzz.check_still_well();
  }
  mocap::wire::fuzz_camera(10 * arguments.count, arguments.seed);
  arguments.print("rounds");
  return 0;
}
