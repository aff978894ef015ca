#pragma once

#include <netinet/in.h>

#include <array>
#include <cstdint>
#include <optional>
#include <span>

namespace mocap::sim {

inline constexpr std::uint16_t kGvcpPort = 3956;
inline constexpr std::size_t kMaxGvcpBytes = 1500;

/// Numbers of GVCP, the most significant byte first.
inline std::uint16_t get16(const std::uint8_t* at) { return static_cast<std::uint16_t>(at[0] << 8 | at[1]); }
inline std::uint32_t get32(const std::uint8_t* at) { return std::uint32_t{get16(at)} << 16 | get16(at + 2); }
inline void put16(std::uint8_t* at, std::uint32_t value) {
  at[0] = static_cast<std::uint8_t>(value >> 8);
  at[1] = static_cast<std::uint8_t>(value);
}
inline void put32(std::uint8_t* at, std::uint32_t value) {
  put16(at, value >> 16);
  put16(at + 2, value);
}

/// The host's clock in UTC, ns since the Unix epoch.
std::int64_t utc_now_ns();

/// One command of a client, and the socket that received it. Source: GigE Vision 2.0, part "GVCP".
struct GvcpCommand {
  int socket = -1;
  sockaddr_in from{};
  std::int64_t arrived_utc_ns =
      0;  ///< when the kernel received it, like the reception time in the hardware of a camera
  std::uint8_t flags = 0;
  std::uint16_t command = 0;
  std::uint16_t request = 0;
  std::span<const std::uint8_t> data;

  /// Sends the acknowledge, whose id is that of the command plus 1.
  void acknowledge(std::span<const std::uint8_t> payload, std::uint16_t status = 0) const;
};

/// A socket at the port of GVCP; -1, and errno, if the address cannot be bound. `shared`: others bind the address, too.
int bound_gvcp_socket(in_addr address, bool shared);

/// Receives one datagram into `packet`, which outlives the command. Nothing if it is no command.
std::optional<GvcpCommand> receive_gvcp(int socket, std::array<std::uint8_t, kMaxGvcpBytes>& packet);

}  // namespace mocap::sim
