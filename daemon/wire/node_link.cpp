#include "wire/node_link.h"

#include <fmt/format.h>
#include <zmq.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <mutex>
#include <thread>
#include <utility>

#include "mocap/v1/node.pb.h"
#include "model/image_bounds.h"
#include "wire/codec/camera_blobs.h"
#include "wire/node_protocol.h"
#include "wire/zmq_socket.h"

namespace mocap::wire {
namespace {

constexpr int kNodeReconnect_ms = 100;
constexpr int kNodeReconnectMax_ms = 400;
constexpr int kNodeHandshake_ms = 2000;
constexpr int kNodeHeartbeat_ms = 1000;
constexpr int kImagesWaiting = 64;                              // 0.5 s at 120 Hz
constexpr int kLongestNodeMessage = 1 << 17;                    // 512 blobs have 45 kB
constexpr int kEndLinger_ms = 500;                              // for the acknowledgement of the last image
constexpr std::size_t kLongestText = 400;                       // of a refusal: it enters log and health
constexpr int kMostNodeCameras = 256;                           // as the server serves
constexpr std::int64_t kMostUptime_ns = std::int64_t{1} << 60;  // 36 years; sums of instants stay in range

NodeCameraState from_wire(v1::NodeEcho::CameraState state) {
  switch (state) {
    case v1::NodeEcho::CAMERA_STATE_DELIVERING: return NodeCameraState::Delivering;
    case v1::NodeEcho::CAMERA_STATE_ENDED: return NodeCameraState::Ended;
    default: return NodeCameraState::NotYet;
  }
}

// A context for each of 64 cameras would have 128 threads, which took 0.6 of a core.
std::shared_ptr<ZmqContext> context_of_node_links() {
  static std::mutex mutex;
  static std::weak_ptr<ZmqContext> shared;
  const std::lock_guard lock(mutex);
  std::shared_ptr<ZmqContext> context = shared.lock();
  if (!context) shared = context = std::make_shared<ZmqContext>();
  return context;
}

// Whether all are instants of a monotonic clock.
bool plausible(std::initializer_list<std::int64_t> instants_ns) {
  return std::ranges::all_of(instants_ns, [](std::int64_t at) { return at >= 0 && at <= kMostUptime_ns; });
}

// Whether the camera of a NodeEcho, or of its list, has an image size that exists.
template <class Camera>
bool possible_size(const Camera& camera) {
  constexpr std::uint32_t kMaxSide_px = kMaxImageSide_px;
  return camera.width_px() <= kMaxSide_px && camera.height_px() <= kMaxSide_px;
}

// Whether a clock can have this time: at most 200 years after its epoch, and not faster or slower than a crystal. Sums
// of two uncertainties stay in range.
bool possible(const v1::NodeEcho::PtpTime& ptp) {
  constexpr std::int64_t kLatest_ns = 200LL * 365 * 24 * 3600 * 1'000'000'000;
  constexpr double kFastest = 1e-2;
  return ptp.time_ns() >= 0 && ptp.time_ns() < kLatest_ns && ptp.uncertainty_ns() >= 0 &&
         ptp.uncertainty_ns() <= kMostUptime_ns && std::abs(ptp.rate()) <= kFastest;
}

// Text of a peer, as one line.
std::string one_line(std::string_view text) {
  std::string line(text.substr(0, kLongestText));
  for (char& c : line) {
    if (static_cast<unsigned char>(c) < 0x20) c = ' ';
  }
  return line;
}

}  // namespace

struct NodeLink::Impl {
  NodeLinkSettings settings;
  std::shared_ptr<ZmqContext> context = context_of_node_links();
  ZmqSocket socket;
  ClientLink link;
  v1::NodeCall call;
  v1::NodeMessage message;
  std::string bytes;
  NodeEcho echo;
  NodeImage image;
  std::string refusal;

  Status connect() {
    const std::string& endpoint = settings.endpoint;
    link.close();
    socket.close();
    if (Status opened = socket.open(*context, ZMQ_DEALER, endpoint); !opened) return opened;
    const struct {
      int option, value;
    } options[] = {{ZMQ_RCVHWM, kImagesWaiting},
                   {ZMQ_LINGER, kEndLinger_ms},
                   {ZMQ_IMMEDIATE, 1},  // a call that waits for a connection would be too old
                   {ZMQ_RECONNECT_IVL, kNodeReconnect_ms},
                   {ZMQ_RECONNECT_IVL_MAX, kNodeReconnectMax_ms},
                   {ZMQ_HANDSHAKE_IVL, kNodeHandshake_ms},
                   {ZMQ_HEARTBEAT_IVL, kNodeHeartbeat_ms},
                   {ZMQ_IPV6, endpoint.starts_with("tcp://[") ? 1 : 0}};
    for (const auto& [option, value] : options) {
      if (Status set = socket.set(option, value); !set) return set;
    }
    if (Status set = socket.set_wide(ZMQ_MAXMSGSIZE, kLongestNodeMessage); !set) return set;
    if (Status set = set_keys(socket, settings.keys); !set) return set;
    link.watch(context->get(), socket.get(), settings.keys.on());
    if (zmq_connect(socket.get(), endpoint.c_str()) != 0) {
      return zmq_failure(fmt::format("endpoint '{}': expected tcp://ADDRESS:PORT or ipc://PATH", endpoint));
    }
    return {};
  }

  void wait(Duration patience) const {
    zmq_pollitem_t item{socket.get(), 0, ZMQ_POLLIN, 0};
    zmq_poll(&item, 1, whole_ms(patience));
  }

  Error malformed(std::string_view what) const {
    return {ErrorCode::Io,
            fmt::format("{}: {}; is this the [node] endpoint of a mocapd of this version?", settings.endpoint, what)};
  }

  Result<NodeNews> read(std::string_view received, Timestamp arrived_at) {
    if (!message.ParseFromArray(received.data(), static_cast<int>(received.size())))
      return malformed("a message that is no NodeMessage of mocap.v1");
    switch (message.content_case()) {
      case v1::NodeMessage::kEcho: return read_echo(arrived_at);
      case v1::NodeMessage::kImage: return read_image();
      case v1::NodeMessage::kRefusal: refusal = one_line(message.refusal()); return NodeNews::Refusal;
      default: return malformed("an empty message");
    }
  }

  Result<NodeNews> read_echo(Timestamp arrived_at) {
    const v1::NodeEcho& from = message.echo();
    if (!possible_size(from) || !std::ranges::all_of(from.cameras(), possible_size<v1::NodeEcho::Camera>)) {
      return malformed("an impossible image size");
    }
    if (from.cameras_size() > kMostNodeCameras) return malformed("too many cameras");
    if (!plausible({from.called_at_ns(), from.received_at_ns(), from.sent_at_ns()})) {
      return malformed("an echo with impossible instants");
    }
    echo.called_at = from_ns(from.called_at_ns());
    echo.received_at = from_ns(from.received_at_ns());
    echo.sent_at = from_ns(from.sent_at_ns());
    echo.arrived_at = arrived_at;
    echo.node = one_line(from.node());
    echo.session = from.session();
    echo.camera = {settings.camera, from.width_px(), from.height_px(), from_wire(from.state())};
    echo.cameras.clear();
    for (const v1::NodeEcho::Camera& each : from.cameras()) {
      echo.cameras.push_back({one_line(each.name()), each.width_px(), each.height_px(), from_wire(each.state())});
    }
    echo.recorded = from.recorded();
    echo.control = one_line(from.control());
    echo.ptp.reset();
    if (!from.has_ptp()) return NodeNews::Echo;
    const v1::NodeEcho::PtpTime& ptp = from.ptp();
    if (!possible(ptp)) return malformed("an impossible PTP time");
    echo.ptp =
        PtpLine{ptp.grandmaster(), echo.sent_at, Duration{ptp.time_ns()}, ptp.rate(), Duration{ptp.uncertainty_ns()}};
    return NodeNews::Echo;
  }

  Result<NodeNews> read_image() {
    const v1::CameraBlobs& from = message.image().blobs();
    if (!plausible({from.exposed_at_ns(), from.received_at_ns(), from.detected_at_ns()})) {
      return malformed("an image with impossible instants");
    }
    const Status decoded = decode(from, image.blobs);
    if (!decoded) return malformed(decoded.error().message);
    image.sequence = message.image().sequence();
    return NodeNews::Image;
  }
};

NodeLink::NodeLink(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
NodeLink::~NodeLink() = default;

Result<std::unique_ptr<NodeLink>> NodeLink::open(const NodeLinkSettings& settings) {
  auto impl = std::make_unique<Impl>();
  impl->settings = settings;
  if (const Status connecting = impl->connect(); !connecting) return connecting.error();
  return std::unique_ptr<NodeLink>(new NodeLink(std::move(impl)));
}

void NodeLink::call(bool ended) {
  Impl& impl = *impl_;
  impl.call.set_protocol(kNodeProtocol);
  impl.call.set_camera(impl.settings.camera);
  impl.call.set_ended(ended);
  impl.call.set_called_at_ns(to_ns(host_now()));
  impl.call.SerializeToString(&impl.bytes);
  zmq_send(impl.socket.get(), impl.bytes.data(), impl.bytes.size(), ZMQ_DONTWAIT);
}

Result<NodeNews> NodeLink::next(Duration patience) {
  Impl& impl = *impl_;
  impl.link.read();
  if (impl.link.gave_up(host_now())) {
    if (const Status connecting = impl.connect(); !connecting) {
      std::this_thread::sleep_for(patience);  // there is no socket to wait for
      return connecting.error();
    }
  }
  ZmqMessage part;
  if (!part.receive(impl.socket)) {
    impl.wait(patience);
    if (!part.receive(impl.socket)) return Error{ErrorCode::Timeout, {}};
  }
  const Timestamp arrived_at = host_now();
  if (!part.has_more()) return impl.read(part.bytes(), arrived_at);
  while (part.has_more() && part.receive(impl.socket)) {
  }
  return impl.malformed("a message of several parts");
}

const NodeEcho& NodeLink::echo() const { return impl_->echo; }
NodeImage& NodeLink::image() { return impl_->image; }
const std::string& NodeLink::refusal() const { return impl_->refusal; }

std::string NodeLink::fault() const {
  return explain(impl_->link.status().fault, impl_->settings.endpoint,
                 {.setting = "[node] endpoint", .server_key = "server_key", .secret_key = "secret_key"});
}

}  // namespace mocap::wire
