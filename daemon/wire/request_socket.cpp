#include "wire/request_socket.h"
#include "wire/zmq_socket.h"

#include <zmq.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <utility>

namespace mocap::wire {
namespace {

// The client reports a fault that persists for this time: about seven attempts of ZeroMQ (one every 100 ms). An
// operator waits for the answer, and reads the fault within a second.
constexpr Duration kFaultIsFinal = std::chrono::milliseconds(800);
constexpr int kRequestHandshake_ms = 700;  // a peer that does not answer the handshake is not a daemon

Timestamp now() { return std::chrono::steady_clock::now(); }

// The next message part of a socket, or nothing.
std::optional<std::string> receive(void* socket) {
  zmq_msg_t message;
  zmq_msg_init(&message);
  std::optional<std::string> bytes;
  if (zmq_msg_recv(&message, socket, ZMQ_DONTWAIT) >= 0)
    bytes.emplace(static_cast<const char*>(zmq_msg_data(&message)), zmq_msg_size(&message));
  zmq_msg_close(&message);
  return bytes;
}

std::string failure(const std::string& endpoint) { return endpoint + ": " + zmq_strerror(zmq_errno()); }

}  // namespace

struct RequestSocket::Impl {
  RequestSettings settings;
  void* context = zmq_ctx_new();
  void* socket = nullptr;
  ClientLink link;
  bool unanswered = false;           // the answer to an earlier request may still arrive
  bool sent = false;                 // the newest request is in the queue of the socket, or was in it
  std::uint64_t without_daemon = 0;  // number of connections until which no daemon can have received it

  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    close();
    if (context != nullptr) zmq_ctx_term(context);
  }

  void close() {
    link.close();
    if (socket != nullptr) zmq_close(socket);
    socket = nullptr;
  }

  bool set(int option, int value) { return zmq_setsockopt(socket, option, &value, sizeof(value)) == 0; }

  bool set_keys() {
    if (settings.server_key.empty()) return true;
    const auto set_key = [this](int option, const std::string& key) {
      return zmq_setsockopt(socket, option, key.c_str(), key.size() + 1) == 0;
    };
    return set_key(ZMQ_CURVE_SERVERKEY, settings.server_key) && set_key(ZMQ_CURVE_PUBLICKEY, settings.public_key) &&
           set_key(ZMQ_CURVE_SECRETKEY, settings.secret_key);
  }

  // Returns an error message, or an empty string.
  std::string connect() {
    const std::string& endpoint = settings.endpoint;
    close();
    unanswered = false;
    if (context != nullptr) socket = zmq_socket(context, ZMQ_DEALER);
    if (socket == nullptr) return failure(endpoint + ": no ZeroMQ socket");
    if (!set(ZMQ_LINGER, 0) || !set(ZMQ_HANDSHAKE_IVL, kRequestHandshake_ms)) return failure(endpoint);
    if (endpoint.starts_with("tcp://[") && !set(ZMQ_IPV6, 1)) return failure(endpoint);
    if (!set_keys()) return endpoint + ": the keys are malformed, or this libzmq was built without CURVE";
    link.watch(context, socket, !settings.server_key.empty());
    if (zmq_connect(socket, endpoint.c_str()) == 0) return {};
    return "endpoint '" + endpoint + "': expected tcp://ADDRESS:PORT or ipc://PATH";
  }

  // A socket whose connection was rejected has no queue any more; retry() then sends the request.
  std::string send(std::string_view request) {
    const LinkStatus& status = link.status();
    sent = zmq_send(socket, request.data(), request.size(), ZMQ_DONTWAIT) >= 0;
    if (!sent && zmq_errno() != EAGAIN) return failure(settings.endpoint);
    unanswered = unanswered || sent;
    without_daemon = status.connected ? status.connections - 1 : status.connections;
    return {};
  }

  // Opens the socket anew after ZeroMQ gave up, because the next attempt may reveal a more precise fault. Sends the
  // request again, unless a daemon may have received it.
  std::string retry(std::string_view request) {
    if (!link.gave_up(now())) return {};
    const bool received = sent && link.status().connections != without_daemon;
    if (std::string fault = connect(); !fault.empty()) return fault;
    return received ? std::string{} : send(request);
  }

  void wait(Duration patience) {
    zmq_pollitem_t items[] = {{socket, 0, ZMQ_POLLIN, 0}, {link.socket(), 0, ZMQ_POLLIN, 0}};
    zmq_poll(items, link.socket() == nullptr ? 1 : 2, whole_ms(patience));
  }

  Reply no_answer(Duration patience) const {
    const LinkStatus& status = link.status();
    Reply reply{{}, status.fault, status.connected, {}};
    if (status.fault != LinkFault::None) {
      reply.why = explain(status.fault, settings.endpoint, settings.words);
      return reply;
    }
    char span[32];
    std::snprintf(span, sizeof(span), "%.1f s", to_s(patience));
    reply.why =
        settings.endpoint + ": no answer within " + span + ": " +
        (status.connected ? "connected, but the daemon is busy; try again or set a longer " + settings.words.timeout
                          : "nothing answers at this address: check the address, the network and firewalls");
    return reply;
  }

  Reply failed(std::string why) const { return {{}, LinkFault::None, link.status().connected, std::move(why)}; }
};

RequestSocket::RequestSocket(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
RequestSocket::~RequestSocket() = default;

std::unique_ptr<RequestSocket> RequestSocket::open(const RequestSettings& settings, std::string& fault) {
  auto impl = std::make_unique<Impl>();
  impl->settings = settings;
  fault = impl->connect();
  return fault.empty() ? std::unique_ptr<RequestSocket>(new RequestSocket(std::move(impl))) : nullptr;
}

Reply RequestSocket::ask(std::string_view request, Duration patience) {
  Impl& impl = *impl_;
  impl.link.read();
  if (impl.unanswered || impl.link.gave_up(now())) {
    if (std::string fault = impl.connect(); !fault.empty()) return impl.failed(std::move(fault));
  }
  if (std::string fault = impl.send(request); !fault.empty()) return impl.failed(std::move(fault));
  const Timestamp until = now() + patience;
  std::optional<Timestamp> failing_since;
  for (;;) {
    impl.link.read();
    if (std::optional<std::string> bytes = receive(impl.socket)) {
      impl.unanswered = false;
      return {std::move(bytes), LinkFault::None, true, {}};
    }
    const Timestamp at = now();
    if (impl.link.status().fault == LinkFault::None)
      failing_since.reset();
    else if (!failing_since)
      failing_since = at;
    if (at >= until || (failing_since && at - *failing_since >= kFaultIsFinal)) return impl.no_answer(patience);
    if (std::string fault = impl.retry(request); !fault.empty()) return impl.failed(std::move(fault));
    impl.wait(std::min(until - at, kLongestWait));
  }
}

}  // namespace mocap::wire
