#include "wire/zmq_subscriber.h"

#include <fmt/core.h>
#include <zmq.h>

#include <cerrno>
#include <chrono>
#include <cstring>

namespace mocap::wire {
namespace {

constexpr int kReconnect_ms = 100;  // first attempt again; then slower, up to
constexpr int kMaxReconnect_ms = 1000;
constexpr int kHeartbeat_ms = 1000;  // a host that vanished is noticed
constexpr const char* kMonitor = "inproc://monitor";

Error last_error(const std::string& what) {
  const int code = zmq_errno();
  const bool ours = code == EINVAL || code == EPROTONOSUPPORT;
  return {ours ? ErrorCode::InvalidArgument : ErrorCode::Io, what + ": " + zmq_strerror(code)};
}

// Closes itself.
struct Message {
  zmq_msg_t raw;
  Message() { zmq_msg_init(&raw); }
  Message(const Message&) = delete;
  Message& operator=(const Message&) = delete;
  ~Message() { zmq_msg_close(&raw); }
  std::string_view bytes() { return {static_cast<const char*>(zmq_msg_data(&raw)), zmq_msg_size(&raw)}; }
};

}  // namespace

struct ZmqSubscriber::Impl {
  void* context = zmq_ctx_new();
  void* socket = nullptr;
  void* monitor = nullptr;
  std::string endpoint;
  LinkStatus link;

  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    if (socket != nullptr) zmq_socket_monitor(socket, nullptr, 0);
    if (monitor != nullptr) zmq_close(monitor);
    if (socket != nullptr) zmq_close(socket);
    if (context != nullptr) zmq_ctx_term(context);
  }

  Status connect(const SubscriberSettings& settings) {
    endpoint = settings.endpoint;
    if (context != nullptr) socket = zmq_socket(context, ZMQ_SUB);
    if (socket == nullptr) return last_error(endpoint + ": no ZeroMQ socket");
    const struct {
      int option, value;
    } options[] = {{ZMQ_RCVHWM, settings.receive_queue}, {ZMQ_LINGER, 0},
                   {ZMQ_RECONNECT_IVL, kReconnect_ms},   {ZMQ_RECONNECT_IVL_MAX, kMaxReconnect_ms},
                   {ZMQ_HEARTBEAT_IVL, kHeartbeat_ms},   {ZMQ_IPV6, endpoint.starts_with("tcp://[") ? 1 : 0}};
    for (const auto& [option, value] : options) {
      if (zmq_setsockopt(socket, option, &value, sizeof(value)) != 0) return last_error(endpoint);
    }
    if (!settings.server_key.empty()) {
      const std::pair<int, const std::string*> keys[] = {{ZMQ_CURVE_SERVERKEY, &settings.server_key},
                                                         {ZMQ_CURVE_PUBLICKEY, &settings.own_key.public_key},
                                                         {ZMQ_CURVE_SECRETKEY, &settings.own_key.secret_key}};
      for (const auto& [option, key] : keys) {
        if (zmq_setsockopt(socket, option, key->data(), key->size()) != 0) return last_error(endpoint + ": key");
      }
    }
    for (const std::string& topic : settings.topics) {
      const std::string prefix = topic + '\0';
      if (zmq_setsockopt(socket, ZMQ_SUBSCRIBE, prefix.data(), prefix.size()) != 0) return last_error(endpoint);
    }
    watch_link();
    if (zmq_connect(socket, endpoint.c_str()) != 0) {
      return last_error(fmt::format("endpoint '{}': expected tcp://ADDRESS:PORT or ipc://PATH", endpoint));
    }
    return {};
  }

  // Without it all works, only the reasons for silence stay unknown.
  void watch_link() {
    constexpr int kEvents = ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_DISCONNECTED | ZMQ_EVENT_CLOSED |
                            ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL | ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL |
                            ZMQ_EVENT_HANDSHAKE_FAILED_AUTH;
    if (zmq_socket_monitor(socket, kMonitor, kEvents) != 0) return;
    monitor = zmq_socket(context, ZMQ_PAIR);
    if (monitor == nullptr) return;
    const int no_linger = 0;
    zmq_setsockopt(monitor, ZMQ_LINGER, &no_linger, sizeof(no_linger));
    if (zmq_connect(monitor, kMonitor) == 0) return;
    zmq_close(monitor);
    monitor = nullptr;
  }

  void read_link() {
    while (monitor != nullptr) {
      Message event;
      if (zmq_msg_recv(&event.raw, monitor, ZMQ_DONTWAIT) < 0) return;
      std::uint16_t kind = 0;
      if (event.bytes().size() >= sizeof(kind)) std::memcpy(&kind, event.bytes().data(), sizeof(kind));
      Message address;
      zmq_msg_recv(&address.raw, monitor, ZMQ_DONTWAIT);
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
  Message message;
  if (zmq_msg_recv(&message.raw, impl_->socket, ZMQ_DONTWAIT) < 0) {
    zmq_pollitem_t item{impl_->socket, 0, ZMQ_POLLIN, 0};
    const auto patience_ms = std::chrono::ceil<std::chrono::milliseconds>(patience).count();
    zmq_poll(&item, 1, static_cast<long>(patience_ms));
    impl_->read_link();
    if (zmq_msg_recv(&message.raw, impl_->socket, ZMQ_DONTWAIT) < 0) {
      if (zmq_errno() == EAGAIN || zmq_errno() == EINTR) return Error{ErrorCode::Timeout, ""};
      return last_error(impl_->endpoint);
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
