#pragma once

#include <chrono>
#include <cstdint>
#include <string>

#include "base/time.h"
#include "wire/peer_greeting.h"

namespace mocap::wire {

/// The reason why a client has no connection to a daemon.
enum class LinkFault {
  None,            ///< connected, or no attempt has failed yet
  NothingListens,  ///< the connection was refused
  NotADaemon,      ///< the peer does not speak ZeroMQ, or is another kind of socket
  ClosedByPeer,    ///< in the handshake with a client without keys; its greeting is not known (PeerGreeting)
  KeyMissing,      ///< the daemon requires a key, the client has none
  KeyNotWanted,    ///< the client has a key, the daemon uses none
  KeyRefused,      ///< the daemon does not know the client's public key
  ServerKeyWrong,  ///< the daemon has another server key than the client expects, or uses none and is not reached by
                   ///< TCP
};

/// State of a client's connection.
struct LinkStatus {
  bool connected = false;               ///< the handshake succeeded and the connection has not ended
  std::uint64_t connections = 0;        ///< successful handshakes
  std::uint64_t refused = 0;            ///< attempts without a program that listens
  std::uint64_t failed_handshakes = 0;  ///< attempts at a peer that is not a daemon or rejects this client
  LinkFault fault = LinkFault::None;    ///< of the last failed attempt; None while connected
};

/// The names that an explanation uses for the settings of both sides.
struct LinkWords {
  std::string setting;  ///< the daemon's configuration key of the endpoint, such as "[publish] endpoint"
  std::string server_key = "--server-key";
  std::string secret_key = "--secret-key";
  std::string timeout = "--timeout-s";
};

/// The fault and its remedy in one line; empty for None.
std::string explain(LinkFault fault, const std::string& endpoint, const LinkWords& words);

/// Follows the connection of a client socket through the events of ZeroMQ's socket monitor. Where these leave the cause
/// of a failed handshake open, it asks for the greeting of the program at the other end. One thread owns it. Needs
/// ZeroMQ alone: the client library in C compiles this class too.
class ClientLink {
 public:
  ClientLink() = default;
  ClientLink(const ClientLink&) = delete;
  ClientLink& operator=(const ClientLink&) = delete;
  ~ClientLink() { close(); }

  /// Starts to watch a ZeroMQ socket; call before its zmq_connect. If this fails, the status stays empty. `socket` must
  /// live until close().
  void watch(void* context, void* socket, bool has_keys);
  /// Ends the watch; the status stays.
  void close();
  /// Processes the events since the last call.
  void read();

  const LinkStatus& status() const { return status_; }
  /// Whether to open the socket anew after a failed handshake. ZeroMQ does not always try again by itself, and the next
  /// attempt may reveal a more precise fault.
  bool gave_up(Timestamp now) const { return failed_since_watch_ && now - failed_at_ > kRetryAfter; }
  /// For zmq_poll: nullptr if nothing is watched.
  void* socket() const { return monitor_; }

 private:
  // Shorter than the time for which a request waits for a better fault (request_socket.cpp).
  static constexpr Duration kRetryAfter = std::chrono::milliseconds(500);

  void read_monitor();
  void note(std::uint16_t kind, std::uint32_t value);
  void note(Greeting greeting);
  void fail();
  void fail_for(LinkFault cause);
  void fail_perhaps_for(LinkFault likeliest);

  void* context_ = nullptr;
  void* monitor_ = nullptr;
  void* watched_ = nullptr;
  bool has_keys_ = false;
  bool handshake_running_ = false;
  bool failed_since_watch_ = false;  // until then the handshake of the newest socket may still succeed
  bool cause_known_ = false;         // of status_.fault
  PeerGreeting greeting_;
  Timestamp failed_at_;
  std::uint64_t watches_ = 0;
  LinkStatus status_;
};

}  // namespace mocap::wire
