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
  context_ = context;
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
  greeting_.close();
  status_.connected = false;
}

void ClientLink::read() {
  read_monitor();
  if (greeting_.is_asking()) note(greeting_.read());
}

void ClientLink::read_monitor() {
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
      handshake_running_ = failed_since_watch_ = cause_known_ = false;
      greeting_.close();
      return;
    case ZMQ_EVENT_DISCONNECTED:
      status_.connected = false;
      // A disconnect during the handshake without an error: the peer is another type of ZeroMQ socket.
      if (handshake_running_) fail_perhaps_for(LinkFault::NotADaemon);
      return;
    case ZMQ_EVENT_CLOSED:
      ++status_.refused;
      status_.fault = LinkFault::NothingListens;
      failed_since_watch_ = cause_known_ = false;
      greeting_.close();
      return;
    case ZMQ_EVENT_HANDSHAKE_FAILED_AUTH: return fail_for(LinkFault::KeyRefused);
    case ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL:
      if (value != ZMQ_PROTOCOL_ERROR_ZMTP_MECHANISM_MISMATCH) return fail_perhaps_for(LinkFault::NotADaemon);
      return fail_for(has_keys_ ? LinkFault::KeyNotWanted : LinkFault::KeyMissing);
    case ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL:
      // The server closed the connection: because of the keys, or because it speaks another protocol.
      if (value != EPIPE) return fail_perhaps_for(LinkFault::NotADaemon);
      return fail_perhaps_for(has_keys_ ? LinkFault::ServerKeyWrong : LinkFault::ClosedByPeer);
    default: return;
  }
}

void ClientLink::note(Greeting greeting) {
  if (greeting == Greeting::Unknown) return;
  LinkFault cause = LinkFault::NotADaemon;
  if (greeting == Greeting::WithoutKeys && has_keys_) cause = LinkFault::KeyNotWanted;
  if (greeting == Greeting::WithKeys) cause = has_keys_ ? LinkFault::ServerKeyWrong : LinkFault::KeyMissing;
  // A daemon that refuses the key of the client says so, after a handshake in which the server key was right.
  const bool is_refused = cause == LinkFault::ServerKeyWrong && status_.fault == LinkFault::KeyRefused;
  if (!is_refused) status_.fault = cause;
  cause_known_ = true;
}

void ClientLink::fail() {
  ++status_.failed_handshakes;
  handshake_running_ = false;
  failed_since_watch_ = true;
  failed_at_ = std::chrono::steady_clock::now();
}

void ClientLink::fail_for(LinkFault cause) {
  fail();
  status_.fault = cause;
  cause_known_ = true;
  greeting_.close();
}

// A cause that is known stays until the greeting says otherwise.
void ClientLink::fail_perhaps_for(LinkFault likeliest) {
  fail();
  if (!cause_known_) status_.fault = likeliest;
  char endpoint[256] = {};
  std::size_t length = sizeof(endpoint);
  if (zmq_getsockopt(watched_, ZMQ_LAST_ENDPOINT, endpoint, &length) == 0) greeting_.ask(context_, endpoint);
}

}  // namespace mocap::wire
