#include "wire/listener.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <linux/sockios.h>
#include <netinet/in.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <zmq.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "base/log.h"
#include "wire/endpoint.h"

namespace mocap::wire {
namespace {

constexpr int kLinger_ms = 100;             // time for the last messages when the socket closes
constexpr int kHandshake_ms = 2000;         // a handshake that takes longer is aborted
constexpr int kHeartbeat_ms = 1000;         // period of heartbeats, which detect dead peers
constexpr int kReceiveQueue = 100;          // messages of one peer; a flood beyond waits in the peer's own connection
constexpr int kSendBuffer_bytes = 1 << 18;  // kernel memory that one stalled peer can occupy
constexpr int kBehind_bytes = 1 << 16;      // unsent data of a slow peer: over 100 ms of a feed at 240 Hz
constexpr int kBacklog = 1024;              // simultaneous connection attempts
constexpr Duration kServeFor = std::chrono::microseconds(500);  // for events of one call, about 3 us each
constexpr int kRequestsPerCall = 16;                            // about 60 us of cryptography each
constexpr Duration kLookForRevoked = std::chrono::milliseconds(500);
constexpr Duration kRepeatAfter = std::chrono::minutes(1);
constexpr std::size_t kMaxLogged = 256;
constexpr const char* kMonitor = "inproc://monitor";

// Returns the peer's address such as "10.0.0.7:51234"; empty if the connection is not a network connection.
std::string peer_of(int connection) {
  sockaddr_storage address{};
  socklen_t size = sizeof(address);
  char text[INET6_ADDRSTRLEN] = {};
  if (::getpeername(connection, reinterpret_cast<sockaddr*>(&address), &size) != 0) return {};
  if (address.ss_family == AF_INET) {
    const auto* v4 = reinterpret_cast<const sockaddr_in*>(&address);
    ::inet_ntop(AF_INET, &v4->sin_addr, text, sizeof(text));
    return fmt::format("{}:{}", text, ntohs(v4->sin_port));
  }
  if (address.ss_family == AF_INET6) {
    const auto* v6 = reinterpret_cast<const sockaddr_in6*>(&address);
    ::inet_ntop(AF_INET6, &v6->sin6_addr, text, sizeof(text));
    return fmt::format("[{}]:{}", text, ntohs(v6->sin6_port));
  }
  return {};
}

const char* fault_of(std::int32_t failure) {
  switch (failure) {
    case ZMQ_PROTOCOL_ERROR_ZMTP_CRYPTOGRAPHIC:
      return "it has another server's key; give it the public key in the file of [security] server_key";
    // A client without a key often closes the connection first, and then looks like a peer that does not speak ZeroMQ.
    default: return "it has no key (mocapctl keys new makes one, keys allow adds it), or does not speak ZeroMQ";
  }
}

std::string without_port(const std::string& peer) { return peer.substr(0, peer.rfind(':')); }

}  // namespace

Listener::Listener(std::string who) : who_(std::move(who)) {}

Listener::~Listener() {
  if (socket_.get() != nullptr) zmq_socket_monitor(socket_.get(), nullptr, 0);
}

Status Listener::open(int kind, int send_queue, const ListenSettings& settings) {
  for (const std::string& endpoint : settings.endpoints) {
    const bool authenticates = settings.curve.on();
    if (Status allowed = check_endpoint(endpoint, settings.allow_remote || authenticates); !allowed) return allowed;
    if (is_taken_ipc(endpoint)) {
      errno = EADDRINUSE;
      return zmq_failure(fmt::format("endpoint '{}'", endpoint));
    }
  }
  if (settings.curve.on()) {
    Result<std::unique_ptr<Gatekeeper>> keeper = Gatekeeper::open(context_, settings.curve, who_, settings.audit);
    if (!keeper) return keeper.error();
    gatekeeper_ = *std::move(keeper);
  }
  max_connections_ = static_cast<std::size_t>(settings.max_connections);
  audit_ = settings.audit;
  if (Status opened = socket_.open(context_, kind, who_); !opened) return opened;
  if (Status set = set_limits(send_queue, settings); !set) return set;
  if (gatekeeper_ != nullptr) {
    if (Status guarded = gatekeeper_->guard(socket_); !guarded) return guarded;
  }
  // A ZAP domain that no handler serves makes ZeroMQ reject peers of ZMTP 1 and 2 (decisions/0003): these receive all
  // topics without a subscription, and their messages do not identify their connection.
  if (gatekeeper_ == nullptr) {
    if (Status set = socket_.set(ZMQ_ZAP_DOMAIN, kAuthenticationDomain); !set) return set;
  }
  watch();
  return bind(settings);
}

Status Listener::set_limits(int send_queue, const ListenSettings& settings) {
  bool v6 = false;
  for (const std::string& endpoint : settings.endpoints) v6 = v6 || endpoint.starts_with("tcp://[");
  const struct {
    int option, value;
  } options[] = {{ZMQ_SNDHWM, send_queue},
                 {ZMQ_RCVHWM, kReceiveQueue},
                 {ZMQ_LINGER, kLinger_ms},
                 {ZMQ_HANDSHAKE_IVL, kHandshake_ms},
                 {ZMQ_HEARTBEAT_IVL, kHeartbeat_ms},
                 {ZMQ_SNDBUF, kSendBuffer_bytes},
                 {ZMQ_BACKLOG, kBacklog},
                 {ZMQ_IPV6, v6 ? 1 : 0}};
  for (const auto& [option, value] : options) {
    if (Status set = socket_.set(option, value); !set) return set;
  }
  return socket_.set_wide(ZMQ_MAXMSGSIZE, settings.max_incoming_bytes);
}

Status Listener::bind(const ListenSettings& settings) {
  for (const std::string& endpoint : settings.endpoints) {
    if (zmq_bind(socket_.get(), endpoint.c_str()) != 0) return zmq_failure(fmt::format("endpoint '{}'", endpoint));
    bound_.push_back(socket_.last_endpoint());
    log_info(who_, fmt::format("listening endpoint={} curve={}", bound_.back(), gatekeeper_ ? "on" : "off"));
    if (!gatekeeper_ && !is_local(endpoint)) {
      log_warn(who_,
               fmt::format("endpoint={} is open to other machines and clients are not authenticated", bound_.back()));
    }
  }
  return {};
}

// Opens the monitor of connection events. If this fails, the socket still works, but connections are not counted.
void Listener::watch() {
  constexpr int kEvents = ZMQ_EVENT_ACCEPTED | ZMQ_EVENT_ACCEPT_FAILED | ZMQ_EVENT_DISCONNECTED |
                          ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_HANDSHAKE_FAILED_NO_DETAIL |
                          ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL | ZMQ_EVENT_HANDSHAKE_FAILED_AUTH;
  if (zmq_socket_monitor(socket_.get(), kMonitor, kEvents) != 0) return;
  if (!monitor_.open(context_, ZMQ_PAIR, who_)) return;
  // The queue is unbounded: a full queue would block ZeroMQ's own thread.
  static_cast<void>(monitor_.set(ZMQ_RCVHWM, 0));
  static_cast<void>(monitor_.set(ZMQ_LINGER, 0));
  if (zmq_connect(monitor_.get(), kMonitor) != 0) monitor_.close();
}

void Listener::serve(Timestamp now) {
  now_ = now;
  while (read_event() && host_now() - now < kServeFor) {
  }
  if (gatekeeper_ == nullptr) return;
  gatekeeper_->serve(kRequestsPerCall, now);
  cut_revoked(now);
}

bool Listener::read_event() {
  if (monitor_.get() == nullptr) return false;
  ZmqMessage event;
  if (!event.receive(monitor_)) return false;
  std::uint16_t kind = 0;
  std::int32_t value = 0;
  if (event.bytes().size() >= sizeof(kind) + sizeof(value)) {
    std::memcpy(&kind, event.bytes().data(), sizeof(kind));
    std::memcpy(&value, event.bytes().data() + sizeof(kind), sizeof(value));
  }
  if (event.has_more()) event.receive(monitor_);  // the second part is the local endpoint
  switch (kind) {
    case ZMQ_EVENT_ACCEPTED: note_accepted(value); break;
    case ZMQ_EVENT_ACCEPT_FAILED: ++figures_.failed_accepts; break;
    case ZMQ_EVENT_HANDSHAKE_SUCCEEDED: ++figures_.connections; break;
    case ZMQ_EVENT_DISCONNECTED: note_gone(value); break;
    case ZMQ_EVENT_HANDSHAKE_FAILED_PROTOCOL: handshake_failure_ = value; break;
    case ZMQ_EVENT_HANDSHAKE_FAILED_AUTH: refusal_logged_ = true; [[fallthrough]];
    default: handshake_failure_ = 0;
  }
  return true;
}

void Listener::note_accepted(int connection) {
  Connection& entry = connections_[connection];
  if (entry.heard) --heard_;
  entry = Connection{};
  entry.peer = peer_of(connection);
  if (!entry.peer.empty()) last_peer_ = without_port(entry.peer);
  if (connections_.size() > max_connections_) {
    cut(connection, fmt::format("the limit of {} connections is reached", max_connections_));
  }
}

void Listener::note_gone(int connection) {
  const auto found = connections_.find(connection);
  if (const auto failure = std::exchange(handshake_failure_, std::nullopt)) {
    ++figures_.failed_handshakes;
    std::string peer = found == connections_.end() ? "" : without_port(found->second.peer);
    if (peer.empty()) peer = last_peer_;  // the connection ended before its address was read
    if (gatekeeper_ != nullptr && !std::exchange(refusal_logged_, false)) {
      warn_refused(peer, fault_of(*failure));
    }
  } else {
    count_end(found == connections_.end() ? Connection{} : found->second);
  }
  if (found == connections_.end()) return;
  if (found->second.heard) --heard_;
  if (found->second.heard && !found->second.cut) note("disconnected", found->second.actor);
  connections_.erase(found);
  gone_.insert(connection);
}

// Counts an ended connection as a disconnection or a failed handshake. ZeroMQ does not report every failed handshake (a
// peer of ZMTP 1 is rejected without an event). The handshake succeeded if the peer sent a message. It may have
// succeeded if there are more established connections than connections that sent a message.
void Listener::count_end(const Connection& connection) {
  if (connection.heard || established() > heard_) {
    ++figures_.disconnections;
  } else {
    ++figures_.failed_handshakes;
  }
}

std::uint64_t Listener::established() const {
  return figures_.connections - std::min(figures_.disconnections, figures_.connections);
}

// Finds a connection. A message may be received before the event that its connection was accepted, so pending events
// are read first.
Listener::Connections::iterator Listener::find(int connection) {
  auto found = connections_.find(connection);
  const Timestamp begun = host_now();
  while (connection >= 0 && found == connections_.end() && host_now() - begun < kServeFor && read_event()) {
    found = connections_.find(connection);
  }
  return found;
}

void Listener::note_user(int connection, std::string_view user) {
  const auto found = find(connection);
  if (found == connections_.end()) return;
  const bool first = !std::exchange(found->second.heard, true);
  if (first) ++heard_;
  if (found->second.user != user) found->second.user = user;
  if (first && audit_ != nullptr) note("connected", found->second.actor = actor_of(connection, user));
  if (gatekeeper_ != nullptr && !gatekeeper_->role_of(user)) cut(connection, "its key was revoked");
}

void Listener::cut_revoked(Timestamp now) {
  if (now - looked_for_revoked_at_ < kLookForRevoked) return;
  looked_for_revoked_at_ = now;
  for (const std::string& key : gatekeeper_->look_for_revoked()) {
    std::vector<int> theirs;
    for (const auto& [connection, entry] : connections_) {
      if (entry.user == key) theirs.push_back(connection);
    }
    for (const int connection : theirs) cut(connection, "its key was revoked");
  }
}

// ZeroMQ has no call that disconnects one peer. The connection is shut down, not closed: ZeroMQ then closes it itself
// (decisions/0002). is_ours() recognises a descriptor that the kernel reused for another connection.
void Listener::cut(int connection, std::string_view why) {
  const auto found = find(connection);
  if (found == connections_.end() || found->second.cut || !is_ours(connection, found->second.peer)) return;
  found->second.cut = true;
  ::shutdown(connection, SHUT_RDWR);
  ++figures_.cut_off;
  note(found->second.heard ? "disconnected" : "refused",
       found->second.heard ? found->second.actor : AuditActor{.address = found->second.peer}, why);
  warn_folded(fmt::format("disconnected a client, address={}: {}", without_port(found->second.peer), why));
}

bool Listener::is_ours(int connection, const std::string& peer) const {
  sockaddr_storage own{};
  socklen_t size = sizeof(own);
  if (::getsockname(connection, reinterpret_cast<sockaddr*>(&own), &size) != 0) return false;
  return peer_of(connection) == peer && (own.ss_family == AF_UNIX || !peer.empty());
}

AuditActor Listener::actor_of(int connection, std::string_view user) const {
  AuditActor actor;
  const auto found = connections_.find(connection);
  actor.address = found == connections_.end() || found->second.peer.empty() ? "local" : found->second.peer;
  if (gatekeeper_ == nullptr) return actor;
  actor.key = user;
  actor.name = gatekeeper_->name_of_user(user);
  if (const auto role = gatekeeper_->role_of(user)) actor.role = name_of(*role);
  return actor;
}

void Listener::note(const char* what, const AuditActor& who, std::string_view reason) const {
  if (audit_ == nullptr) return;
  AuditEntry entry{.what = what, .who = who, .details = {{"socket", who_}}};
  if (!reason.empty()) entry.details.emplace_back("reason", reason);
  audit_->note(std::move(entry));
}

void Listener::warn_folded(const std::string& what) {
  if (logged_at_.size() >= kMaxLogged) logged_at_.clear();
  const auto [entry, first] = logged_at_.try_emplace(what, now_);
  if (!first && now_ - entry->second < kRepeatAfter) return;
  entry->second = now_;
  log_warn(who_, what);
}

// Logs one line for a peer that retries, also if its first attempt was logged with an unknown address.
void Listener::warn_refused(const std::string& peer, const char* why) {
  note("refused", {.address = peer.empty() ? "unknown" : peer}, why);
  const auto line = [&](const char* address) { return fmt::format("refused a client, address={}: {}", address, why); };
  if (peer.empty()) {
    warn_folded(line("unknown"));
  } else if (logged_at_.erase(line("unknown")) > 0) {
    logged_at_[line(peer.c_str())] = now_;
  } else {
    warn_folded(line(peer.c_str()));
  }
}

FeedHealth Listener::figures() const {
  FeedHealth figures = figures_;
  figures.listeners = static_cast<std::uint32_t>(std::max<std::uint64_t>(established(), heard_));
  if (gatekeeper_ != nullptr) figures.refused_clients = gatekeeper_->refused();
  figures.behind = behind();
  return figures;
}

// Counts the slow peers by the unsent bytes in the kernel: ZeroMQ does not report for which peer it drops messages.
std::uint32_t Listener::behind() const {
  std::uint32_t count = 0;
  for (const auto& [connection, entry] : connections_) {
    int waiting_bytes = 0;
    if (::ioctl(connection, SIOCOUTQ, &waiting_bytes) == 0 && waiting_bytes > kBehind_bytes) ++count;
  }
  return count;
}

}  // namespace mocap::wire
