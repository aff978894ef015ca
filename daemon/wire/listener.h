#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/time.h"
#include "model/audit.h"
#include "model/health.h"
#include "module/audit_trail.h"
#include "wire/gatekeeper.h"
#include "wire/zmq_socket.h"

namespace mocap::wire {

struct ListenSettings {
  std::vector<std::string> endpoints;  ///< tcp://ADDRESS:PORT (port * takes a free one) or ipc://PATH
  bool allow_remote = false;           ///< other machines may connect although clients are not authenticated
  CurveSettings curve;
  int max_incoming_bytes = 1024;  ///< a peer that sends a longer message is disconnected; a handshake has up to 550
  int max_connections = 1000;     ///< the newest connections above this number are closed
  AuditTrail* audit = nullptr;    ///< outlives the listener; null: connections are not noted
};

/// A listening ZeroMQ socket with limits on incoming data, CURVE authentication and a list of its connections.
///
/// A connection is identified by its file descriptor. One thread owns the Listener.
class Listener {
 public:
  explicit Listener(std::string who);
  ~Listener();

  /// Binds to all endpoints. `kind` is ZMQ_XPUB or another ZeroMQ socket type; `send_queue` is the number of messages
  /// that wait for one peer. Fails with InvalidArgument, NotFound, Busy (another program listens there) and Io.
  Status open(int kind, int send_queue, const ListenSettings& settings);

  /// Processes connection events and authentication requests and closes connections whose key was revoked. Takes about
  /// 1.5 ms at most. Call at least ten times a second: a client can connect only after its request was answered.
  void serve(Timestamp now);

  /// Connections that ended since the last call of `heard_all`. A message that carries one of these descriptors may
  /// come from a new connection with the same descriptor.
  const std::set<int>& gone() const { return gone_; }
  /// Clears `gone`. Call when no message waits to be received.
  void heard_all() { gone_.clear(); }

  /// Closes the connection with this file descriptor if it belongs to this socket. `why` is for the log.
  void cut(int connection, std::string_view why);

  /// Records that a message of `user` (empty without CURVE) came by this connection, so that the connection can be
  /// closed when the key is revoked.
  void note_user(int connection, std::string_view user);

  /// The other side of a connection that sent a message of `user`.
  AuditActor actor_of(int connection, std::string_view user) const;

  const ZmqSocket& socket() const { return socket_; }
  ZmqSocket& socket() { return socket_; }
  const std::vector<std::string>& endpoints() const { return bound_; }  ///< with the port numbers in use
  const Gatekeeper* gatekeeper() const { return gatekeeper_.get(); }
  /// The ZeroMQ socket that becomes readable when an authentication request waits; null without CURVE.
  void* asking_socket() const { return gatekeeper_ ? gatekeeper_->socket() : nullptr; }
  /// The counters of the feed except `subscriptions`. Costs one system call for each connection: call once a second.
  FeedHealth figures() const;

 private:
  struct Connection {
    std::string peer;  // address and port; empty if unknown (ipc)
    std::string user;
    AuditActor actor = {};  // if connections are noted
    bool heard = false;     // sent a message, so its handshake succeeded
    bool cut = false;
  };
  using Connections = std::map<int, Connection>;  // by file descriptor
  Status set_limits(int send_queue, const ListenSettings& settings);
  Status bind(const ListenSettings& settings);
  void watch();
  bool read_event();
  Connections::iterator find(int connection);
  void note_accepted(int connection);
  void note_gone(int connection);
  void count_end(const Connection& connection);
  std::uint64_t established() const;
  void cut_revoked(Timestamp now);
  std::uint32_t behind() const;
  bool is_ours(int connection, const std::string& peer) const;

  std::string who_;
  ZmqContext context_;
  std::unique_ptr<Gatekeeper> gatekeeper_;
  ZmqSocket socket_;
  ZmqSocket monitor_;
  std::vector<std::string> bound_;
  Connections connections_;
  std::size_t heard_ = 0;  // connections with `heard`
  std::set<int> gone_;
  std::size_t max_connections_ = 0;
  AuditTrail* audit_ = nullptr;
  FeedHealth figures_;
  std::string last_peer_;        // of the newest connection whose address is known
  bool refusal_logged_ = false;  // the Gatekeeper logged why the last handshake failed
  /// Set if the next "disconnected" event is due to a failed handshake: ZeroMQ's protocol error code, or 0.
  std::optional<std::int32_t> handshake_failure_;
  std::map<std::string, Timestamp> logged_at_;  // by log line: time of its last output
  Timestamp now_;
  Timestamp looked_for_revoked_at_;

  void note(const char* what, const AuditActor& who, std::string_view reason = {}) const;
  void warn_folded(const std::string& what);
  void warn_refused(const std::string& peer, const char* why);
};

}  // namespace mocap::wire
