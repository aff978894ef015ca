#pragma once

#include <compare>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "base/time.h"

namespace mocap {

/// An IPv4 address and a port of UDP, both in host byte order.
struct Peer {
  std::uint32_t address = 0;
  std::uint16_t port = 0;

  friend auto operator<=>(const Peer&, const Peer&) = default;
};

/// A datagram and the other side: its sender, or its receiver.
struct Datagram {
  std::size_t socket = 0;  ///< of this side, an index
  Peer peer;
  std::string bytes;
  bool cut = false;  ///< of a received one: it was larger than the port reads
};

/// UDP sockets of one thread.
class DatagramPort {
 public:
  virtual ~DatagramPort() = default;

  /// Waits at most `patience` for a datagram, and returns early without one when the descriptor `wake` is readable.
  virtual std::optional<Datagram> next(int wake, Duration patience) = 0;

  /// Sends a datagram, or drops it if the system does not take it at once.
  virtual void send(const Datagram& datagram) = 0;
};

}  // namespace mocap
