#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

namespace mocap::bench {

/// Reads the number of a snapshot, which is the first field of its Protobuf message. 0 if the message is too short.
inline std::uint64_t snapshot_number(std::string_view message) {
  std::uint64_t number = 0;
  for (std::size_t i = 1, shift = 0; i < message.size() && shift < 64; ++i, shift += 7) {
    const auto byte = static_cast<unsigned char>(message[i]);
    number |= static_cast<std::uint64_t>(byte & 0x7FU) << shift;
    if (byte < 0x80U) return number;
  }
  return 0;
}

}  // namespace mocap::bench
