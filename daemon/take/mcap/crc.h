#pragma once

#include <cstdint>
#include <string_view>

namespace mocap::take::mcap {

/// CRC-32 (ISO 3309, as in zlib) of bytes that follow bytes with the checksum `before`; 0 before the first byte.
std::uint32_t crc32_of(std::string_view bytes, std::uint32_t before = 0);

}  // namespace mocap::take::mcap
