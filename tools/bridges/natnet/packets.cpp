#include "bridges/natnet/packets.h"

namespace mocap::natnet {
namespace {

constexpr std::size_t kName_bytes = 256;

}  // namespace

std::string_view server_info_packet(PacketWriter& writer, const ServerInfo& info) {
  writer.begin(Message::ServerInfo);
  constexpr std::string_view kName = "mocapd";
  for (std::size_t i = 0; i < kName_bytes; ++i) writer.put(i < kName.size() ? kName[i] : '\0');
  for (const unsigned part : {0U, 1U, 0U, 0U}) writer.put(static_cast<std::uint8_t>(part));  // of this program
  writer.put(info.version.major);
  writer.put(info.version.minor);
  writer.put(std::uint16_t{0});
  writer.put(kTicksPerSecond);
  writer.put(info.data_port);
  writer.put(static_cast<std::uint8_t>(info.multicast ? 1 : 0));
  for (const std::uint8_t part : info.group) writer.put(part);
  return writer.finish();
}

std::string_view echo_packet(PacketWriter& writer, std::uint64_t stamp, std::uint64_t now_ns) {
  writer.begin(Message::EchoResponse);
  writer.put(stamp);
  writer.put(now_ns);
  return writer.finish();
}

std::string_view unrecognised_packet(PacketWriter& writer) {
  writer.begin(Message::Unrecognised);
  return writer.finish();
}

std::string_view response_packet(PacketWriter& writer, std::int32_t code) {
  writer.begin(Message::Response);
  writer.put(code);
  return writer.finish();
}

std::string_view response_packet(PacketWriter& writer, float number) {
  writer.begin(Message::Response);
  writer.put(number);
  return writer.finish();
}

std::string_view response_packet(PacketWriter& writer, std::string_view text) {
  writer.begin(Message::Response);
  writer.put_text(text);
  return writer.finish();
}

}  // namespace mocap::natnet
