#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "module/datagram_port.h"

namespace mocap::trigger {

/// Reads an IPv4 address in dotted decimal notation; empty if `text` is none.
std::optional<std::uint32_t> read_address(std::string_view text);

/// Reads "10.0.0.7:1510", port 1 to 65535; empty if `text` is no address with a port.
std::optional<Peer> read_peer(std::string_view text);

/// "10.0.0.7"
std::string address_text(std::uint32_t address);

}  // namespace mocap::trigger
