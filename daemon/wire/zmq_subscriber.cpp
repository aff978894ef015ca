#include "wire/zmq_subscriber.h"

#include <fmt/core.h>
#include <zmq.h>

#include <cerrno>
#include <chrono>
#include <cstring>

#include "wire/zmq_socket.h"

namespace mocap::wire {
namespace {

constexpr int kReconnect_ms = 100;  // first attempt again; then slower, up to
constexpr int kMaxReconnect_ms = 1000;
constexpr int kHeartbeat_ms = 1000;  // a host that vanished is noticed
constexpr const char* kMonitor = "inproc://monitor";

}  // namespace

struct ZmqSubscriber::Impl {
  ZmqContext context;
  ZmqSocket socket;
  ZmqSocket monitor;
  std::string endpoint;
  LinkStatus link;

  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    if (socket.get() != nullptr) zmq_socket_monitor(socket.get(), nullptr, 0);
  }

  Status connect(const SubscriberSettings& settings) {
    endpoint = settings.endpoint;
    if (Status opened = socket.open(context, ZMQ_SUB, endpoint); !opened) return opened;
    const struct {
      int option, value;
    } options[] = {{ZMQ_RCVHWM, settings.receive_queue}, {ZMQ_LINGER, 0},
                   {ZMQ_RECONNECT_IVL, kReconnect_ms},   {ZMQ_RECONNECT_IVL_MAX, kMaxReconnect_ms},
                   {ZMQ_HEARTBEAT_IVL, kHeartbeat_ms},   {ZMQ_IPV6, endpoint.starts_with("tcp://[") ? 1 : 0}};
    for (const auto& [option, value] : options) {
      if (Status set = socket.set(option, value); !set) return set;
    }
    if (!settings.server_key.empty()) {
      const std::pair<int, const std::string*> keys[] = {{ZMQ_CURVE_SERVERKEY, &settings.server_key},
                                                         {ZMQ_CURVE_PUBLICKEY, &settings.own_key.public_key},
                                                         {ZMQ_CURVE_SECRETKEY, &settings.own_key.secret_key}};
      for (const auto& [option, key] : keys) {
        if (Status set = socket.set(option, *key); !set) return set;
      }
    }
    for (const std::string& topic : settings.topics) {
      if (Status set = socket.set(ZMQ_SUBSCRIBE, topic + '\0'); !set) return set;
    }
    watch_link();
    if (zmq_connect(socket.get(), endpoint.c_str()) != 0) {
      return zmq_failure(fmt::format("endpoint '{}': expected tcp://ADDRESS:PORT or ipc://PATH", endpoint));
    }
    return {};
  }

  // Without it all works, only the reasons for silence stay unknown.
  void watch_link() {
    constexpr int kEvents = ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_DISCONNECTED | ZMQ_EVENT_CLOSED |
                            ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL | ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL |
                            ZMQ_EVENT_HANDSHAKE_FAILED_AUTH;
    if (zmq_socket_monitor(socket.get(), kMonitor, kEvents) != 0) return;
    const bool watching = monitor.open(context, ZMQ_PAIR, endpoint) && monitor.set(ZMQ_LINGER, 0) &&
                          zmq_connect(monitor.get(), kMonitor) == 0;
    if (!watching) monitor.close();
  }

  void read_link() {
    ZmqMessage event;
    while (monitor.get() != nullptr && event.receive(monitor)) {
      std::uint16_t kind = 0;
      if (event.bytes().size() >= sizeof(kind)) std::memcpy(&kind, event.bytes().data(), sizeof(kind));
      static_cast<void>(event.receive(monitor));  // the address
      note(kind);
    }
  }

  void note(std::uint16_t kind) {
    switch (kind) {
      case ZMQ_EVENT_HANDSHAKE_SUCCEEDED:
        link.connected = true;
        ++link.connections;
        return;
      case ZMQ_EVENT_DISCONNECTED: link.connected = false; return;
      case ZMQ_EVENT_CLOSED: ++link.refused; return;
      default: ++link.failed_handshakes; return;
    }
  }
};

ZmqSubscriber::ZmqSubscriber(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
ZmqSubscriber::~ZmqSubscriber() = default;

const LinkStatus& ZmqSubscriber::link() const { return impl_->link; }

Result<std::unique_ptr<ZmqSubscriber>> ZmqSubscriber::open(const SubscriberSettings& settings) {
  auto impl = std::make_unique<Impl>();
  if (const Status connecting = impl->connect(settings); !connecting) return connecting.error();
  return std::unique_ptr<ZmqSubscriber>(new ZmqSubscriber(std::move(impl)));
}

Result<FeedMessage> ZmqSubscriber::next(Duration patience) {
  impl_->read_link();
  ZmqMessage message;
  if (!message.receive(impl_->socket)) {
    zmq_pollitem_t item{impl_->socket.get(), 0, ZMQ_POLLIN, 0};
    const auto patience_ms = std::chrono::ceil<std::chrono::milliseconds>(patience).count();
    zmq_poll(&item, 1, static_cast<long>(patience_ms));
    impl_->read_link();
    if (!message.receive(impl_->socket)) {
      if (zmq_errno() == EAGAIN || zmq_errno() == EINTR) return Error{ErrorCode::Timeout, ""};
      return zmq_failure(impl_->endpoint);
    }
  }
  const std::string_view bytes = message.bytes();
  const auto end = bytes.find('\0');
  if (end == std::string_view::npos) {
    return Error{ErrorCode::InvalidArgument, impl_->endpoint + ": a message without a topic; is this a mocapd feed?"};
  }
  return FeedMessage{std::string(bytes.substr(0, end)), std::string(bytes.substr(end + 1))};
}

}  // namespace mocap::wire
