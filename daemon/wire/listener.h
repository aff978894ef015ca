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
#include "model/health.h"
#include "wire/gatekeeper.h"
#include "wire/zmq_socket.h"

namespace mocap::wire {

struct ListenSettings {
  std::vector<std::string> endpoints;  ///< tcp://ADDRESS:PORT (port * takes a free one) or ipc://PATH
  bool allow_remote = false;  ///< listen where other machines can reach it, though nobody is asked who they are
  CurveSettings curve;
  int max_incoming_bytes = 4096;  ///< who sends more in one message is cut off
  int max_connections = 1000;     ///< the newest over that are cut off
};

/// A socket that others connect to, with what guards it: limits on what comes in, CURVE, and a watch over who is
/// connected. One thread owns it.
class Listener {
 public:
  explicit Listener(std::string who);
  ~Listener();

  /// Binds to all endpoints, or to none. `kind`: ZMQ_XPUB and so on; `send_queue`: messages that wait for one peer.
  Status open(int kind, int send_queue, const ListenSettings& settings);

  /// Lets in who waits, notes who came and went, throws out who is no longer allowed. Takes a bounded time; often, and
  /// at least some ten times a second, or nobody gets in.
  void serve(Timestamp now);

  /// Connections that ended since the last call of `heard_all`. What is still read from one of them may be of whoever
  /// has its descriptor now.
  const std::set<int>& gone() const { return gone_; }
  /// Nothing waits to be read.
  void heard_all() { gone_.clear(); }

  /// Ends the connection of this file descriptor, if it is one of ours.
  void cut(int connection, std::string_view why);

  /// A message came by this connection from this user (empty: without keys): remembered, so that it can be cut when its
  /// key is revoked.
  void note_user(int connection, std::string_view user);

  const ZmqSocket& socket() const { return socket_; }
  ZmqSocket& socket() { return socket_; }
  const std::vector<std::string>& endpoints() const { return bound_; }  ///< with true ports
  const Gatekeeper* gatekeeper() const { return gatekeeper_.get(); }
  /// The ZeroMQ socket that becomes readable when somebody asks to be let in; null where nobody is asked.
  void* asking_socket() const { return gatekeeper_ ? gatekeeper_->socket() : nullptr; }
  /// All but subscriptions. A system call a connection: once a second.
  FeedHealth figures() const;

 private:
  struct Connection {
    std::string peer;  // its address, empty where nobody knows (ipc)
    std::string user;
    bool heard = false;  // it sent a message: its handshake was through
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
  void cut_the_revoked(Timestamp now);
  std::uint32_t behind() const;
  bool is_ours(int connection, const std::string& peer) const;

  std::string who_;
  ZmqContext context_;
  std::unique_ptr<Gatekeeper> gatekeeper_;
  ZmqSocket socket_;
  ZmqSocket monitor_;
  std::vector<std::string> bound_;
  Connections connections_;
  std::size_t heard_ = 0;  // of them
  std::set<int> gone_;
  std::size_t max_connections_ = 0;
  FeedHealth figures_;
  std::string last_peer_;         // of the newest connection whose address is known
  bool gatekeeper_told_ = false;  // the log has why
  /// The handshake of the next connection that is told to be gone failed, and how: ZeroMQ's code, or 0.
  std::optional<std::int32_t> handshake_failure_;
  std::map<std::string, Timestamp> told_;  // lines of the log, and when it had them
  Timestamp now_;
  Timestamp looked_for_revoked_at_;

  void tell_once(const std::string& what);
  void tell_refused(const std::string& peer, const char* why);
};

}  // namespace mocap::wire
