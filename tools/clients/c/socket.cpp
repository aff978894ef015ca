#include "socket.h"

#include <zmq.h>

#include <cerrno>
#include <chrono>
#include <cstring>

namespace mocap::client {
namespace {

constexpr int kReconnect_ms = 100;  // first attempt again; then slower, up to
constexpr int kMaxReconnect_ms = 1000;
constexpr int kHandshake_ms = 2000;  // who listens and says nothing is no feed
constexpr int kHeartbeat_ms = 1000;  // a host that vanished is noticed
constexpr int kQueue = 1000;         // messages that wait here while our thread is kept from running
// Descriptions of 16 subjects are 100 kB; whoever sends more than that fills our memory and no more.
constexpr std::int64_t kMaxMessage_bytes = 8 << 20;
constexpr int kMessagesATime = 1000;  // then the thread looks at the connection again
constexpr std::int64_t kTryAnew_ns = 500'000'000;
constexpr const char* kMonitor = "inproc://monitor-";  // and a number: the last one may not be gone yet
constexpr const char* kStop = "inproc://stop";

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

Now now() {
  using std::chrono::duration_cast;
  using std::chrono::nanoseconds;
  return {duration_cast<nanoseconds>(std::chrono::steady_clock::now().time_since_epoch()).count(),
          duration_cast<nanoseconds>(std::chrono::system_clock::now().time_since_epoch()).count()};
}

struct Socket::Impl {
  SocketSettings settings;
  void* context = zmq_ctx_new();
  void* feed = nullptr;
  void* monitor = nullptr;
  void* stop_reader = nullptr;
  void* stop_writer = nullptr;
  Link link;
  std::uint64_t attempts = 0;
  bool shaking_hands = false;       // connected, and neither through nor failed yet
  std::int64_t try_anew_at_ns = 0;  // ZeroMQ has given up; 0: it has not

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
    if (feed != nullptr) zmq_socket_monitor(feed, nullptr, 0);
    if (monitor != nullptr) zmq_close(monitor);
    if (feed != nullptr) zmq_close(feed);
    monitor = feed = nullptr;
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

  // Gives what is wrong, or nothing.
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
    if (!set_keys()) return "the keys cannot be used: is this libzmq built with CURVE?";
    for (const std::string& topic : {std::string("description"), std::string("health"), settings.topic}) {
      const std::string prefix = topic + '\0';
      if (zmq_setsockopt(feed, ZMQ_SUBSCRIBE, prefix.data(), prefix.size()) != 0) return zmq_strerror(zmq_errno());
    }
    watch();
    if (zmq_connect(feed, settings.endpoint.c_str()) == 0) return {};
    return "endpoint '" + settings.endpoint + "': expected tcp://ADDRESS:PORT or ipc://PATH";
  }

  // Without it all works, only the reasons for silence stay unknown.
  void watch() {
    constexpr int kEvents = ZMQ_EVENT_CONNECTED | ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_DISCONNECTED |
                            ZMQ_EVENT_CLOSED | ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL |
                            ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH;
    const std::string at = kMonitor + std::to_string(++attempts);
    if (zmq_socket_monitor(feed, at.c_str(), kEvents) != 0) return;
    monitor = zmq_socket(context, ZMQ_PAIR);
    if (monitor == nullptr) return;
    const int none = 0;
    zmq_setsockopt(monitor, ZMQ_LINGER, &none, sizeof(none));
    if (zmq_connect(monitor, at.c_str()) == 0) return;
    zmq_close(monitor);
    monitor = nullptr;
  }

  void read_monitor() {
    while (monitor != nullptr) {
      Message event;
      if (zmq_msg_recv(&event.raw, monitor, ZMQ_DONTWAIT) < 0) return;
      std::uint16_t kind = 0;
      std::uint32_t value = 0;
      if (event.bytes().size() >= sizeof(kind) + sizeof(value)) {
        std::memcpy(&kind, event.bytes().data(), sizeof(kind));
        std::memcpy(&value, event.bytes().data() + sizeof(kind), sizeof(value));
      }
      Message address;
      zmq_msg_recv(&address.raw, monitor, ZMQ_DONTWAIT);
      note(kind, value);
    }
  }

  void failed(std::int32_t why, bool given_up) {
    // Who hangs up first decides how much is told: what was told exactly is believed longer.
    const bool vague = why == MOCAP_NOT_A_FEED || why == MOCAP_SERVER_KEY_WRONG;
    const bool exact = link.handshake == MOCAP_KEY_MISSING || link.handshake == MOCAP_KEY_REFUSED;
    if (!(vague && exact)) link.handshake = why;
    shaking_hands = false;
    if (given_up) try_anew_at_ns = now().host_ns + kTryAnew_ns;
  }

  void set_connected(bool connected) {
    if (link.connected != connected) link.since_ns = now().host_ns;
    link.connected = connected;
  }

  void note(std::uint16_t kind, std::uint32_t value) {
    switch (kind) {
      case ZMQ_EVENT_CONNECTED: shaking_hands = true; return;
      case ZMQ_EVENT_HANDSHAKE_SUCCEEDED:
        set_connected(true);
        ++link.connections;
        link.refused = 0;
        link.handshake = MOCAP_WELL;
        shaking_hands = false;
        try_anew_at_ns = 0;
        return;
      case ZMQ_EVENT_DISCONNECTED:
        set_connected(false);
        // Gone in the middle of the handshake, and no word why: another kind of ZeroMQ socket.
        if (shaking_hands) failed(MOCAP_NOT_A_FEED, true);
        return;
      case ZMQ_EVENT_CLOSED:
        ++link.refused;
        link.handshake = MOCAP_WELL;
        return;
      case ZMQ_EVENT_HANDSHAKE_FAILED_AUTH: return failed(MOCAP_KEY_REFUSED, true);
      case ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL:
        return failed(value == ZMQ_PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH ? MOCAP_KEY_MISSING : MOCAP_NOT_A_FEED, true);
      case ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL:
        // A server to whom our words are noise hangs up; one that speaks another language does so too.
        return failed(settings.keys.server.empty() || value != EPIPE ? MOCAP_NOT_A_FEED : MOCAP_SERVER_KEY_WRONG,
                      false);
      default: return;
    }
  }

  void try_anew() {
    if (try_anew_at_ns == 0 || now().host_ns < try_anew_at_ns) return;
    try_anew_at_ns = 0;
    close_feed();
    if (!connect().empty()) try_anew_at_ns = now().host_ns + kTryAnew_ns;
  }
};

Socket::Socket(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Socket::~Socket() = default;

const Link& Socket::link() const { return impl_->link; }

std::unique_ptr<Socket> Socket::open(const SocketSettings& settings, std::string& fault) {
  auto impl = std::make_unique<Impl>();
  impl->settings = settings;
  impl->link.since_ns = now().host_ns;
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
      {impl.stop_reader, 0, ZMQ_POLLIN, 0}, {impl.feed, 0, ZMQ_POLLIN, 0}, {impl.monitor, 0, ZMQ_POLLIN, 0}};
  const int sockets = impl.feed == nullptr ? 1 : impl.monitor == nullptr ? 2 : 3;
  zmq_poll(items, sockets, patience_ms);
  if ((items[0].revents & ZMQ_POLLIN) != 0) return false;
  impl.read_monitor();
  for (int i = 0; i < kMessagesATime && impl.feed != nullptr; ++i) {
    Message message;
    if (zmq_msg_recv(&message.raw, impl.feed, ZMQ_DONTWAIT) < 0) break;
    // A message of several parts is none of ours; its first part is looked at like any.
    take(message.bytes());
  }
  return true;
}

void Socket::interrupt() { zmq_send(impl_->stop_writer, "", 0, ZMQ_DONTWAIT); }

}  // namespace mocap::client
