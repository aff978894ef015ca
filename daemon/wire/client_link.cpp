#include "wire/client_link.h"

#include <zmq.h>

#include <cerrno>
#include <cstdint>
#include <cstring>

namespace mocap::wire {

std::string explain(LinkFault fault, const std::string& endpoint, const LinkWords& words) {
  const std::string both = words.server_key + " and " + words.secret_key;
  const std::string compare = "compare the port with " + words.setting;
  const std::string create = "create one with 'mocapctl keys new', allow it there, and give " + both;
  switch (fault) {
    case LinkFault::NothingListens:
      return "nothing listens at " + endpoint + ": start mocapd, or compare address and port with " + words.setting;
    case LinkFault::NotADaemon:
      return "the program at " + endpoint + " is not a mocapd, or this is another of its ports: " + compare;
    case LinkFault::ClosedByPeer:
      return "the program at " + endpoint + " requires a key (" + create + "), or it is not a mocapd: " + compare;
    case LinkFault::KeyMissing: return endpoint + " requires a key: " + create;
    case LinkFault::KeyNotWanted:
      return endpoint + " uses no keys: omit " + both + ", or set [security] server_key there";
    case LinkFault::KeyRefused:
      return endpoint +
             " does not know the public key of this client, or the key was revoked: allow it there with 'mocapctl keys "
             "allow'";
    case LinkFault::ServerKeyWrong:
      return endpoint + " does not have the server key of this client, or uses no keys: give " + words.server_key +
             " the public key in the file of [security] server_key there; or this is another of its ports: " + compare;
    case LinkFault::None: break;
  }
  return {};
}

void ClientLink::watch(void* context, void* socket, bool has_keys) {
  constexpr int kEvents = ZMQ_EVENT_CONNECTED | ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_DISCONNECTED |
                          ZMQ_EVENT_CLOSED | ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL |
                          ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH;
  close();
  has_keys_ = has_keys;
  handshake_running_ = failed_since_watch_ = false;
  // The previous monitor and those of other links in the context may still exist: each has its own address.
  const std::string address =
      "inproc://monitor-" + std::to_string(reinterpret_cast<std::uintptr_t>(this)) + "-" + std::to_string(++watches_);
  if (zmq_socket_monitor(socket, address.c_str(), kEvents) != 0) return;
  watched_ = socket;
  monitor_ = zmq_socket(context, ZMQ_PAIR);
  const int none = 0;
  const bool watching = monitor_ != nullptr && zmq_setsockopt(monitor_, ZMQ_LINGER, &none, sizeof(none)) == 0 &&
                        zmq_connect(monitor_, address.c_str()) == 0;
  if (!watching) close();
}

void ClientLink::close() {
  if (watched_ != nullptr) zmq_socket_monitor(watched_, nullptr, 0);
  if (monitor_ != nullptr) zmq_close(monitor_);
  watched_ = monitor_ = nullptr;
  status_.connected = false;
}

void ClientLink::read() {
  // An event has two parts: kind and value, then the address.
  constexpr std::size_t kEvent_bytes = sizeof(std::uint16_t) + sizeof(std::uint32_t);
  char event[kEvent_bytes];
  while (monitor_ != nullptr && zmq_recv(monitor_, event, sizeof(event), ZMQ_DONTWAIT) >= 0) {
    std::uint16_t kind = 0;
    std::uint32_t value = 0;
    std::memcpy(&kind, event, sizeof(kind));
    std::memcpy(&value, event + sizeof(kind), sizeof(value));
    zmq_recv(monitor_, nullptr, 0, ZMQ_DONTWAIT);
    note(kind, value);
  }
}

void ClientLink::note(std::uint16_t kind, std::uint32_t value) {
  switch (kind) {
    case ZMQ_EVENT_CONNECTED: handshake_running_ = true; return;
    case ZMQ_EVENT_HANDSHAKE_SUCCEEDED:
      status_.connected = true;
      ++status_.connections;
      status_.fault = LinkFault::None;
      handshake_running_ = false;
      failed_in_a_row_ = 0;
      return;
    case ZMQ_EVENT_DISCONNECTED:
      status_.connected = false;
      // A disconnect during the handshake without an error: the peer is another type of ZeroMQ socket.
      if (handshake_running_) fail(LinkFault::NotADaemon);
      return;
    case ZMQ_EVENT_CLOSED:
      ++status_.refused;
      status_.fault = LinkFault::NothingListens;
      failed_in_a_row_ = 0;
      return;
    case ZMQ_EVENT_HANDSHAKE_FAILED_AUTH: return fail(LinkFault::KeyRefused);
    case ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL:
      if (value != ZMQ_PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH) return fail(LinkFault::NotADaemon);
      return fail(has_keys_ ? LinkFault::KeyNotWanted : LinkFault::KeyMissing);
    case ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL:
      // The server closed the connection: because of the keys, or because it speaks another protocol.
      if (value != EPIPE) return fail(LinkFault::NotADaemon);
      return fail(has_keys_ ? LinkFault::ServerKeyWrong : LinkFault::ClosedByPeer);
    default: return;
  }
}

bool ClientLink::is_precise() const {
  return status_.fault == LinkFault::KeyMissing || status_.fault == LinkFault::KeyNotWanted ||
         status_.fault == LinkFault::KeyRefused;
}

Duration ClientLink::retry_after() const {
  // Which fault is seen depends on the side that closes the connection first: a vague one is tried again soon.
  constexpr int kSoon = 40;
  return is_precise() || failed_in_a_row_ > kSoon ? std::chrono::milliseconds(500) : std::chrono::milliseconds(50);
}

void ClientLink::fail(LinkFault fault) {
  ++status_.failed_handshakes;
  const bool vague =
      fault == LinkFault::NotADaemon || fault == LinkFault::ClosedByPeer || fault == LinkFault::ServerKeyWrong;
  if (!(vague && is_precise())) status_.fault = fault;
  handshake_running_ = false;
  failed_since_watch_ = true;
  ++failed_in_a_row_;
  failed_at_ = std::chrono::steady_clock::now();
}

}  // namespace mocap::wire
