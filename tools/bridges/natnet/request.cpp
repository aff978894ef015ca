#include "bridges/natnet/request.h"

#include <cstring>

namespace mocap::natnet {
namespace {

constexpr std::size_t kHeader_bytes = 4;
// Offsets in CONNECT: header, name[256], version of the program[4], version of NatNet[4], u8 subscribed only, version
// of the bitstream[4]. The last two exist from 4.0 on.
constexpr std::size_t kClientVersion = 264;
constexpr std::size_t kSubscribedOnly = 268;
constexpr std::size_t kBitstreamVersion = 269;

std::uint8_t byte_at(std::string_view packet, std::size_t at) {
  return at < packet.size() ? static_cast<std::uint8_t>(packet[at]) : std::uint8_t{0};
}

Version version_at(std::string_view packet, std::size_t at) { return {byte_at(packet, at), byte_at(packet, at + 1)}; }

// The version of the bitstream, or else the client's own version.
std::optional<Version> wanted_version(std::string_view packet) {
  for (const std::size_t at : {kBitstreamVersion, kClientVersion}) {
    if (const Version version = version_at(packet, at); version.major != 0) return version;
  }
  return std::nullopt;
}

}  // namespace

std::optional<Request> read_request(std::string_view packet) {
  if (packet.size() < kHeader_bytes) return std::nullopt;
  std::uint16_t number = 0;
  std::memcpy(&number, packet.data(), sizeof number);
  Request request;
  request.message = static_cast<Message>(number);
  const std::string_view payload = packet.substr(kHeader_bytes);
  switch (request.message) {
    case Message::Connect:
    case Message::Discovery:
      request.wanted = wanted_version(packet);
      request.subscribed_only = byte_at(packet, kSubscribedOnly) == 1;
      return request;
    case Message::Request: request.text = payload.substr(0, payload.find('\0')); return request;
    case Message::EchoRequest:
      if (payload.size() < sizeof request.stamp) return std::nullopt;
      std::memcpy(&request.stamp, payload.data(), sizeof request.stamp);
      return request;
    case Message::RequestModels:
    case Message::RequestFrame:
    case Message::Disconnect:
    case Message::KeepAlive: return request;
    default: return std::nullopt;  // a message of a server, or none of NatNet
  }
}

}  // namespace mocap::natnet
