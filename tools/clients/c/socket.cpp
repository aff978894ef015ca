#include "socket.h"

#include <zmq.h>

#include "clock.h"

namespace mocap::client {
namespace {

constexpr int kReconnect_ms = 100;  // interval of the first reconnect attempts
constexpr int kMaxReconnect_ms = 1000;
constexpr int kHandshake_ms = 2000;  // a peer that does not answer the handshake is not a feed
constexpr int kHeartbeat_ms = 1000;  // detects a host that has disappeared
constexpr int kQueue = 1000;         // messages that wait while the receive thread does not run
// The description of 16 subjects has 100 kB. Larger messages are refused to bound the memory.
constexpr std::int64_t kMaxMessage_bytes = 8 << 20;
constexpr int kMessagesATime = 1000;  // after this number the thread checks the connection
constexpr const char* kStop = "inproc://stop";

// A ZeroMQ message that is closed by its destructor.
struct Message {
  zmq_msg_t raw;
  Message() { zmq_msg_init(&raw); }
  Message(const Message&) = delete;
  Message& operator=(const Message&) = delete;
  ~Message() { zmq_msg_close(&raw); }
  std::string_view bytes() { return {static_cast<const char*>(zmq_msg_data(&raw)), zmq_msg_size(&raw)}; }
};

}  // namespace

struct Socket::Impl {
  SocketSettings settings;
  void* context = zmq_ctx_new();
  void* feed = nullptr;
  void* stop_reader = nullptr;
  void* stop_writer = nullptr;
  wire::ClientLink link;
  bool was_connected = false;
  std::int64_t since_ns = now().host_ns;  // of the last change of was_connected

  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    close_feed();
    if (stop_reader != nullptr) zmq_close(stop_reader);
    if (stop_writer != nullptr) zmq_close(stop_writer);
    if (context != nullptr) zmq_ctx_term(context);
  }

  void close_feed() {
    link.close();
    if (feed != nullptr) zmq_close(feed);
    feed = nullptr;
  }

  bool pair(void*& socket, bool binds) {
    socket = context == nullptr ? nullptr : zmq_socket(context, ZMQ_PAIR);
    if (socket == nullptr) return false;
    const int none = 0;
    zmq_setsockopt(socket, ZMQ_LINGER, &none, sizeof(none));
    return (binds ? zmq_bind(socket, kStop) : zmq_connect(socket, kStop)) == 0;
  }

  bool set_keys() {
    if (settings.keys.server.empty()) return true;
    const auto set = [this](int option, const std::string& key) {
      return zmq_setsockopt(feed, option, key.c_str(), key.size() + 1) == 0;
    };
    return set(ZMQ_CURVE_SERVERKEY, settings.keys.server) && set(ZMQ_CURVE_PUBLICKEY, settings.keys.own_public) &&
           set(ZMQ_CURVE_SECRETKEY, settings.keys.own_secret);
  }

  // Returns an error message, or an empty string.
  std::string connect() {
    feed = context == nullptr ? nullptr : zmq_socket(context, ZMQ_SUB);
    if (feed == nullptr) return std::string("no ZeroMQ socket: ") + zmq_strerror(zmq_errno());
    const struct {
      int option, value;
    } options[] = {{ZMQ_RCVHWM, kQueue},
                   {ZMQ_LINGER, 0},
                   {ZMQ_RECONNECT_IVL, kReconnect_ms},
                   {ZMQ_RECONNECT_IVL_MAX, kMaxReconnect_ms},
                   {ZMQ_HANDSHAKE_IVL, kHandshake_ms},
                   {ZMQ_HEARTBEAT_IVL, kHeartbeat_ms},
                   {ZMQ_IPV6, settings.endpoint.find("tcp://[") == 0 ? 1 : 0}};
    for (const auto& [option, value] : options) {
      if (zmq_setsockopt(feed, option, &value, sizeof(value)) != 0) return zmq_strerror(zmq_errno());
    }
    zmq_setsockopt(feed, ZMQ_MAXMSGSIZE, &kMaxMessage_bytes, sizeof(kMaxMessage_bytes));
    if (!set_keys()) return "the keys cannot be used: was this libzmq built with CURVE?";
    for (const std::string& topic :
         {std::string("description"), std::string("health"), std::string("event"), settings.topic}) {
      const std::string prefix = topic + '\0';
      if (zmq_setsockopt(feed, ZMQ_SUBSCRIBE, prefix.data(), prefix.size()) != 0) return zmq_strerror(zmq_errno());
    }
    link.watch(context, feed, !settings.keys.server.empty());
    if (zmq_connect(feed, settings.endpoint.c_str()) == 0) return {};
    return "endpoint '" + settings.endpoint + "': expected tcp://ADDRESS:PORT or ipc://PATH";
  }

  void read_link() {
    link.read();
    const bool connected = link.status().connected;
    if (connected != was_connected) since_ns = now().host_ns;
    was_connected = connected;
  }

  void try_anew() {
    if (feed != nullptr && !link.gave_up(std::chrono::steady_clock::now())) return;
    close_feed();
    connect();
  }
};

Socket::Socket(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Socket::~Socket() = default;

Link Socket::link() const {
  const wire::LinkStatus& status = impl_->link.status();
  return {status.connected, impl_->since_ns, status.connections, status.fault};
}

std::unique_ptr<Socket> Socket::open(const SocketSettings& settings, std::string& fault) {
  auto impl = std::make_unique<Impl>();
  impl->settings = settings;
  fault = impl->connect();
  if (fault.empty() && !(impl->pair(impl->stop_reader, true) && impl->pair(impl->stop_writer, false))) {
    fault = std::string("no ZeroMQ socket: ") + zmq_strerror(zmq_errno());
  }
  if (!fault.empty()) return nullptr;
  return std::unique_ptr<Socket>(new Socket(std::move(impl)));
}

bool Socket::receive(int patience_ms, const std::function<void(std::string_view)>& take) {
  Impl& impl = *impl_;
  impl.try_anew();
  zmq_pollitem_t items[] = {
      {impl.stop_reader, 0, ZMQ_POLLIN, 0}, {impl.feed, 0, ZMQ_POLLIN, 0}, {impl.link.socket(), 0, ZMQ_POLLIN, 0}};
  const int sockets = impl.feed == nullptr ? 1 : impl.link.socket() == nullptr ? 2 : 3;
  zmq_poll(items, sockets, patience_ms);
  if ((items[0].revents & ZMQ_POLLIN) != 0) return false;
  impl.read_link();
  for (int i = 0; i < kMessagesATime && impl.feed != nullptr; ++i) {
    Message message;
    if (zmq_msg_recv(&message.raw, impl.feed, ZMQ_DONTWAIT) < 0) break;
    // The feed sends no multipart messages. Each part is processed as one message.
    take(message.bytes());
  }
  return true;
}

void Socket::interrupt() { zmq_send(impl_->stop_writer, "", 0, ZMQ_DONTWAIT); }

}  // namespace mocap::client
