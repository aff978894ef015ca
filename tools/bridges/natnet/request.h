#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "bridges/natnet/packet_writer.h"
#include "bridges/natnet/version.h"

namespace mocap::natnet {

/// One packet of a client. The text points into the packet.
struct Request {
  Message message = Message::Connect;
  std::string_view text;          ///< of Request, without the zero byte
  std::optional<Version> wanted;  ///< of Connect: the version of the bitstream that the client asks for
  bool subscribed_only = false;   ///< of Connect
  std::uint64_t stamp = 0;        ///< of EchoRequest
};

/// Reads an untrusted packet. Lenient as to its size, because clients declare sizes that differ from what they send.
/// Empty: no request of a client.
std::optional<Request> read_request(std::string_view packet);

}  // namespace mocap::natnet
