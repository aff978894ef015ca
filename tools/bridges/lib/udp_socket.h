#pragma once

#include <netinet/in.h>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "bridges/lib/descriptor.h"

namespace mocap::bridge {

/// An IPv4 address and a port, both in host byte order.
struct Peer {
  std::uint32_t address = INADDR_LOOPBACK;
  std::uint16_t port = 0;

  auto operator<=>(const Peer&) const = default;
};

/// "10.0.0.7:1510".
std::string to_string(const Peer& peer);

/// Reads an IPv4 address in dotted decimal notation; empty if `text` is none.
std::optional<std::uint32_t> read_address(const std::string& text);
constexpr bool is_loopback(std::uint32_t address) { return address >> 24U == 127; }
/// Whether the machine has a way from its address `from` to the address `to`. Sends nothing. From a loopback address
/// only the addresses of this machine are reached.
bool has_route(std::uint32_t from, std::uint32_t to);
constexpr bool is_multicast(std::uint32_t address) { return address >> 28U == 14; }

enum class Sent {
  Done,
  Dropped,  ///< the kernel has no room: the packet is lost
  Refused   ///< the packet cannot be sent at all
};

/// A UDP socket over IPv4 that never blocks.
class UdpSocket {
 public:
  static constexpr std::size_t kMaxPacket_bytes = 65507;  ///< the largest payload of UDP over IPv4

  /// Binds to `at`; port 0: any. Returns nothing if that fails, with the reason and a remedy in `fault`.
  static std::optional<UdpSocket> open(const Peer& at, std::string& fault);

  /// Sends multicasts from the interface with this address, also to programs on this machine; `hops` is the time to
  /// live. False: there is no such interface.
  bool send_multicast_from(std::uint32_t address, int hops);

  Sent send(const Peer& to, std::string_view packet) const;
  /// Passes each receiver at whose port nobody listens to `unreachable`, as far as its machine reports that (ICMP),
  /// then every waiting packet, at most 64 at a time, to `take`. The packet is valid during the call.
  void receive(
      const std::function<void(const Peer& from, std::string_view packet)>& take,
      const std::function<void(const Peer&)>& unreachable = [](const Peer& /*peer*/) {});

  int descriptor() const { return socket_.number(); }
  /// The address and port that the socket has.
  Peer bound() const;

 private:
  explicit UdpSocket(Descriptor socket) : socket_(std::move(socket)), packet_(kMaxPacket_bytes) {}
  void read_reports(const std::function<void(const Peer&)>& unreachable) const;

  Descriptor socket_;
  std::vector<char> packet_;
};

}  // namespace mocap::bridge
