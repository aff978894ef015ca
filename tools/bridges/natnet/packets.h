#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "bridges/natnet/packet_writer.h"
#include "bridges/natnet/scene.h"
#include "bridges/natnet/settings.h"

namespace mocap::natnet {

/// Each function returns the packet, which is valid until `writer` is used again. Empty: the packet would be larger
/// than UDP allows.

/// FRAMEOFDATA. `sent_ns`: now, on this machine's monotonic clock.
std::string_view frame_packet(PacketWriter& writer, const Scene& scene, const Settings& settings,
                              std::uint64_t sent_ns);

/// MODELDEF: for each subject a marker set and a rigid body or a skeleton, and the marker set "all".
std::string_view models_packet(PacketWriter& writer, const Scene& scene, const Settings& settings);

struct ServerInfo {
  Version version;
  std::uint16_t data_port = 1511;
  bool multicast = false;
  std::array<std::uint8_t, 4> group{};  ///< of the multicast
};

constexpr std::uint64_t kTicksPerSecond = 1'000'000'000;

std::string_view server_info_packet(PacketWriter& writer, const ServerInfo& info);
std::string_view echo_packet(PacketWriter& writer, std::uint64_t stamp, std::uint64_t now_ns);
std::string_view unrecognised_packet(PacketWriter& writer);
std::string_view response_packet(PacketWriter& writer, std::int32_t code);
std::string_view response_packet(PacketWriter& writer, float number);
std::string_view response_packet(PacketWriter& writer, std::string_view text);

/// The id of a bone or a labelled marker in frames: model << 16 | member, both from 1.
constexpr std::int32_t member_id(std::int32_t model, std::size_t index) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(model) << 16U | (static_cast<std::uint32_t>(index) + 1U));
}

}  // namespace mocap::natnet
